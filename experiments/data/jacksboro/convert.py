"""The Jacksboro fault elevations of matplotlib's sample data as an ESRI ASCII grid in degrees.

    python convert.py jacksboro_fault_dem.npz jacksboro_degrees.asc

Needs numpy. The archive holds `elevation` (rows from north to south, metres) and `xmin`, `xmax`, `ymin`, `ymax`, the
outer edges of the cells in degrees (its `ymin` is the northern edge), with the cell size in `dx`, `dy`.
"""

import sys

import numpy as np


def main(source, destination):
    with np.load(source) as archive:
        elevation = archive["elevation"]
        west, east = sorted((float(archive["xmin"]), float(archive["xmax"])))
        south, north = sorted((float(archive["ymin"]), float(archive["ymax"])))
        dx, dy = float(archive["dx"]), float(archive["dy"])
    rows, columns = elevation.shape
    # The edges must be those of the cells: otherwise the corner below would be half a cell off.
    if abs((east - west) / dx - columns) > 1e-6 or abs((north - south) / dy - rows) > 1e-6:
        sys.exit(f"{source}: the edges are not {columns} x {rows} cells of {dx} x {dy} degrees apart")
    with open(destination, "w", encoding="ascii") as file:
        file.write(f"ncols {columns}\nnrows {rows}\nxllcorner {west!r}\nyllcorner {south!r}\n")
        file.write(f"cellsize {dx!r}\n" if dx == dy else f"dx {dx!r}\ndy {dy!r}\n")
        file.write("NODATA_value -9999\n")
        for row in elevation:
            file.write(" ".join(str(int(value)) for value in row) + "\n")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2])
