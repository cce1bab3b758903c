//! Figures of the prose against the papers' own tables.

use super::search::{Finding, Form};
use super::{Certificate, Kind};
use crate::tables::{genevaux2015_table1, paris2019_table1};

pub(super) const ALL: &[Certificate] = &[
    Certificate {
        id: "table1-densities",
        shows: "A scene of the table has less than ten primitives per km².",
        control: "the scenes with more",
        certifies: &[],
        kind: Kind::Proof(densities),
    },
    Certificate {
        id: "fig1-primitives",
        shows: "The table counts more primitives in Fig. 1 than its caption.",
        control: "the count of Fig. 3",
        certifies: &[],
        kind: Kind::Proof(fig1),
    },
    Certificate {
        id: "table1-calls",
        shows: "Sphere tracing evaluates every terrain of the table 24 to 39 times per pixel.",
        control: "at most 24 times",
        certifies: &[],
        kind: Kind::Proof(calls),
    },
    Certificate {
        id: "table1-within-a-second",
        shows: "No time of the table is above a second.",
        control: "half a second",
        certifies: &[],
        kind: Kind::Proof(within_a_second),
    },
    Certificate {
        id: "table1-mesh-slower",
        shows: "In two scenes of the table the mesh takes longer than sphere tracing.",
        control: "the scenes with at most 20 million mesh vertices",
        certifies: &[],
        kind: Kind::Proof(mesh_slower),
    },
    Certificate {
        id: "paris-speedup",
        shows: "A scene of the table is polygonized more than 12 times as fast.",
        control: "the other four scenes",
        certifies: &[],
        kind: Kind::Proof(speedup),
    },
    Certificate {
        id: "paris-benagil",
        shows: "The speed-up of Benagil in the table is below 1.8 by more than its rounding.",
        control: "1.4",
        certifies: &[],
        kind: Kind::Proof(benagil),
    },
    Certificate {
        id: "paris-memory",
        shows: "A scene of the table takes less than 100 times less memory than material stacks.",
        control: "the sea scene alone",
        certifies: &[],
        kind: Kind::Proof(memory),
    },
    Certificate {
        id: "paris-cells",
        shows: "No scene of the table has cells of 10 cm.",
        control: "1 m",
        certifies: &[],
        kind: Kind::Proof(cells),
    },
    Certificate {
        id: "paris-areas",
        shows: "A scene of the table is larger than 5 km².",
        control: "36 km²",
        certifies: &[],
        kind: Kind::Proof(areas),
    },
    Certificate {
        id: "paris-calls",
        shows: "Marching cubes are said to have asked for fewer values than their grid has vertices.",
        control: "the sea scene",
        certifies: &[],
        kind: Kind::Proof(baseline_calls),
    },
    Certificate {
        id: "hnaidi-memory",
        shows: "Ten grids of 1024 × 1024 floats are 40 MB.",
        control: "eleven grids",
        certifies: &[],
        kind: Kind::Proof(grids),
    },
];

/// "The value is above the limit": a proof that a printed limit fails.
fn exceeds(value: f64, limit: f64, at: &str) -> Finding {
    if value > limit {
        Finding::Proved { bound: value, attained: limit, boxes: 1 }
    } else {
        Finding::Refuted { bound: value, value: limit, at: at.to_owned() }
    }
}

const UNREAD: Finding = Finding::Undecided { bound: f64::NAN, known: f64::NAN, boxes: 0 };

fn densities(form: Form) -> Finding {
    let Ok(table) = genevaux2015_table1() else { return UNREAD };
    let of = |scene: &str| table.rows.iter().find(|row| row.scene == scene);
    let Some(row) = of(form.pick("Fig 19", "Fig 1")) else { return UNREAD };
    exceeds(10.0, row.primitives_per_km2(), &row.scene)
}

fn fig1(form: Form) -> Finding {
    let Ok(table) = genevaux2015_table1() else { return UNREAD };
    let Some(row) = table.rows.iter().find(|row| row.scene == form.pick("Fig 1", "Fig 3")) else { return UNREAD };
    exceeds(f64::from(row.primitives), 30.0, &row.scene)
}

fn calls(form: Form) -> Finding {
    let Ok(table) = genevaux2015_table1() else { return UNREAD };
    Finding::all(table.rows.iter().map(|row| {
        let calls = table.calls_per_pixel(row);
        if calls < 24.0 {
            return exceeds(calls, 24.0, &row.scene);
        }
        exceeds(form.pick(39.0, 24.5), calls, &row.scene)
    }))
}

fn within_a_second(form: Form) -> Finding {
    let Ok(table) = genevaux2015_table1() else { return UNREAD };
    let slowest = table.rows.iter().map(|row| row.sphere_tracing_ms.max(row.mesh_ms)).fold(0.0, f64::max);
    exceeds(form.pick(1000.0, 500.0), slowest, "the slowest scene")
}

fn mesh_slower(form: Form) -> Finding {
    let Ok(table) = genevaux2015_table1() else { return UNREAD };
    let small = |calls: u64| calls <= 20_000_000;
    let rows = table.rows.iter().filter(|row| small(row.mesh_calls) == (form == Form::Perturbed));
    Finding::all(rows.map(|row| exceeds(row.mesh_ms, row.sphere_tracing_ms, &row.scene)))
}

fn speedup(form: Form) -> Finding {
    let Ok(table) = paris2019_table1() else { return UNREAD };
    let mut ratios: Vec<f64> = table.rows.iter().map(|row| row.speedup()).collect();
    ratios.sort_by(f64::total_cmp);
    let best = form.pick(ratios.len() - 1, ratios.len() - 2);
    exceeds(ratios[best], 12.0, "the best scene")
}

fn benagil(form: Form) -> Finding {
    let Ok(table) = paris2019_table1() else { return UNREAD };
    let Some(row) = table.rows.iter().find(|row| row.scene.starts_with("Benagil")) else { return UNREAD };
    // Times are printed to a tenth of a second: the largest ratio that prints as this row.
    let most = (row.baseline_seconds + 0.05) / (row.seconds - 0.05);
    exceeds(form.pick(1.75, 1.4), most, &row.scene)
}

fn memory(form: Form) -> Finding {
    let Ok(table) = paris2019_table1() else { return UNREAD };
    let ratios = table.rows.iter().take(form.pick(table.rows.len(), 1)).map(|row| row.memory_ratio());
    exceeds(100.0, ratios.fold(f64::INFINITY, f64::min), "the worst scene")
}

fn cells(form: Form) -> Finding {
    let Ok(table) = paris2019_table1() else { return UNREAD };
    let finest = table.rows.iter().map(|row| row.cell_metres()).fold(f64::INFINITY, f64::min);
    exceeds(finest, form.pick(0.1, 1.0), "the finest grid")
}

fn areas(form: Form) -> Finding {
    let Ok(table) = paris2019_table1() else { return UNREAD };
    let largest = table.rows.iter().map(|row| row.side_km * row.side_km).fold(0.0, f64::max);
    exceeds(largest, form.pick(5.0, 36.0), "the largest scene")
}

fn baseline_calls(form: Form) -> Finding {
    let Ok(table) = paris2019_table1() else { return UNREAD };
    let scenes = form.pick(["Karst", "Benagil"], ["Sea", "Sea"]);
    let rows = table.rows.iter().filter(|row| scenes.iter().any(|scene| row.scene.starts_with(scene)));
    Finding::all(rows.map(|row| {
        let vertices: f64 = row.grid.iter().map(|&side| f64::from(side)).product();
        exceeds(vertices, row.baseline_calls as f64, &row.scene)
    }))
}

fn grids(form: Form) -> Finding {
    let bytes = form.pick(10.0, 11.0) * 1024.0 * 1024.0 * 4.0;
    let megabytes = bytes / (1024.0 * 1024.0);
    if megabytes == 40.0 {
        Finding::Proved { bound: 40.0, attained: megabytes, boxes: 1 }
    } else {
        Finding::Refuted { bound: 40.0, value: megabytes, at: "the grids".to_owned() }
    }
}
