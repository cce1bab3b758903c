//! Coordinate reference systems as well-known text (OGC 01-009, WKT 1), the content of a `.prj` file. A system with an EPSG code is
//! written as the registry has it; text that names no code is kept as it stands, so that a file that is read and written loses nothing.

use crate::grid::{Crs, CrsKind};
use std::borrow::Cow;

const LOCAL: &str = "LOCAL_CS[\"local metres\",UNIT[\"metre\",1.0]]";
/// Degrees without a code: the datum is not stated, and every reader wants one.
const DEGREES: u16 = 4326;

/// The system that a well-known text describes; `None` where it is neither projected, geographic nor local.
pub(super) fn read(text: &str) -> Option<Crs> {
    let text = text.trim();
    let upper = text.to_ascii_uppercase();
    let starts = |names: &[&str]| names.iter().any(|name| upper.starts_with(name));
    let epsg = authority(&upper).or_else(|| utm(&upper));
    let kind = if starts(&["GEOGCS", "GEOGCRS"]) {
        let wgs84 = upper.contains("WGS_1984") || upper.contains("WGS 84");
        CrsKind::Geographic { epsg: epsg.or(wgs84.then_some(4326)) }
    } else if starts(&["LOCAL_CS"]) {
        return Some(Crs::local_metres());
    } else if starts(&["PROJCS", "PROJCRS"]) {
        // The projection's own unit is the last UNIT of WKT 1: UNIT["Foot_US",0.3048006096012192].
        let unit = upper.rsplit("UNIT[").next().and_then(|unit| unit.split([',', ']']).nth(1)).map(str::trim);
        let metres_per_unit = unit.and_then(|unit| unit.parse().ok()).filter(|u: &f64| u.is_finite()).unwrap_or(1.0);
        CrsKind::Projected { epsg, metres_per_unit }
    } else {
        return None;
    };
    let coded = matches!(kind, CrsKind::Projected { epsg: Some(_), .. } | CrsKind::Geographic { epsg: Some(_) });
    Some(Crs { wkt: (!coded).then(|| text.to_owned()), ..Crs::new(kind) })
}

/// The text of a system; `None` for a projection that has neither text nor a code the registry knows.
pub(super) fn write(crs: &Crs) -> Option<Cow<'_, str>> {
    if let Some(text) = &crs.wkt {
        return Some(text.into());
    }
    match crs.kind {
        CrsKind::LocalMetres => Some(LOCAL.into()),
        CrsKind::Geographic { epsg } => registered(epsg.unwrap_or(DEGREES)),
        CrsKind::Projected { epsg, .. } => registered(epsg?),
    }
}

fn registered(code: u16) -> Option<Cow<'static, str>> {
    crs_definitions::from_code(code).map(|known| known.wkt.into())
}

/// The code of the whole system: the AUTHORITY that closes the text, not that of one of its parts.
fn authority(upper: &str) -> Option<u16> {
    let last = upper.rsplit("AUTHORITY[").next()?;
    let (name, rest) = last.strip_prefix('"')?.split_once("\",\"")?;
    let code = rest.strip_suffix("\"]]")?;
    if name == "EPSG" { code.parse().ok() } else { None }
}

/// The code of a zone of the universal transverse Mercator system named in ESRI's manner, which states no authority.
fn utm(upper: &str) -> Option<u16> {
    let name = upper.strip_prefix("PROJCS[\"")?.split('"').next()?;
    let (datum, zone) = name.split_once("_UTM_ZONE_")?;
    let (number, hemisphere) = zone.split_at_checked(zone.len().checked_sub(1)?)?;
    let number = number.parse::<u16>().ok().filter(|zone| (1..=60).contains(zone))?;
    match (datum, hemisphere) {
        ("WGS_1984", "N") => Some(32600 + number),
        ("WGS_1984", "S") => Some(32700 + number),
        ("NAD_1983", "N") if number <= 23 => Some(26900 + number),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_code_survives_its_text() {
        for code in [32611, 32756, 26910, 2263, 27700, 3857, 2154] {
            let crs = Crs::projected(Some(code));
            let text = write(&crs).expect("a registered code");
            let CrsKind::Projected { epsg, metres_per_unit } = read(&text).unwrap().kind else { panic!("{text}") };
            assert_eq!(epsg, Some(code), "{text}");
            assert_eq!(metres_per_unit == 1.0, code != 2263, "New York's feet: {text}");
        }
        assert_eq!(read(&write(&Crs::geographic(Some(4269))).unwrap()), Some(Crs::geographic(Some(4269))));
        assert_eq!(read(&write(&Crs::local_metres()).unwrap()), Some(Crs::local_metres()));
        assert_eq!(write(&Crs::projected(Some(1))), None, "no such code");
    }

    #[test]
    fn the_code_of_a_part_is_not_that_of_the_whole() {
        let text = r#"PROJCS["mine",GEOGCS["WGS 84",AUTHORITY["EPSG","4326"]],UNIT["metre",1]]"#;
        let crs = read(text).unwrap();
        assert_eq!(crs.kind, CrsKind::Projected { epsg: None, metres_per_unit: 1.0 });
        assert_eq!(write(&crs).as_deref(), Some(text));
    }

    #[test]
    fn zones_are_known_by_name() {
        let zone = |name: &str| read(&format!("PROJCS[\"{name}\",UNIT[\"Meter\",1.0]]")).unwrap().kind;
        let coded = |code| CrsKind::Projected { epsg: code, metres_per_unit: 1.0 };
        assert_eq!(zone("WGS_1984_UTM_Zone_11N"), coded(Some(32611)));
        assert_eq!(zone("WGS_1984_UTM_Zone_56S"), coded(Some(32756)));
        assert_eq!(zone("NAD_1983_UTM_Zone_10N"), coded(Some(26910)));
        for other in ["NAD_1983_UTM_Zone_60N", "WGS_1984_UTM_Zone_61N", "WGS_1984_UTM_Zone_", "ED_1950_UTM_Zone_30N"] {
            assert_eq!(zone(other), coded(None), "{other}");
        }
    }
}
