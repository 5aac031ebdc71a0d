"""rasterio writes GeoTIFF height maps to a folder, and prints where it finds which heights, as JSON.

Run by the Rust test `height_map::geotiffs_of_rasterio_have_the_same_heights_at_the_same_places`.
"""

import itertools
import json
import pathlib
import sys

import numpy as np
import rasterio
from rasterio.transform import Affine

METRES = "EPSG:25832"
NORTH_UP = Affine(0.5, 0, 512_300.25, 0, -0.25, 54_100.75)
SOUTH_UP = Affine(2, 0, -40, 0, 3, 17.5)
COLUMNS, ROWS = 53, 37
TILES = {"tiled": True, "blockxsize": 16, "blockysize": 32}
STRIPS = {"blockysize": 5}
NODATA = -9999


def heights_of(dtype, seed):
    """Random heights that a type of samples can hold."""
    source = np.random.default_rng(seed)
    if np.issubdtype(dtype, np.floating):
        return source.uniform(-900, 900, (ROWS, COLUMNS)).astype(dtype)
    low, high = max(np.iinfo(dtype).min, -9000), min(np.iinfo(dtype).max, 9000)
    return source.integers(low, high, (ROWS, COLUMNS), endpoint=True).astype(dtype)


def write(path, heights, transform=NORTH_UP, crs=METRES, tags=None, scale=None, mask=None, **options):
    size = {"width": heights.shape[-1], "height": heights.shape[-2], "count": 1 if heights.ndim == 2 else len(heights)}
    profile = {"driver": "GTiff", "dtype": heights.dtype.name, "crs": crs, "transform": transform, **size, **options}
    with rasterio.open(path, "w", **profile) as dataset:
        dataset.update_tags(**(tags or {}))
        if scale:
            dataset.scales, dataset.offsets = [scale[0]], [scale[1]]
        if not options.get("sparse_ok"):
            dataset.write(heights if heights.ndim == 3 else heights[np.newaxis])
        if mask is not None:
            dataset.write_mask(mask)


def found(path):
    """The heights that rasterio reads, row after row from the south, and their positions."""
    with rasterio.open(path) as dataset:
        heights = dataset.read(1, masked=True).astype(float).filled(np.nan)
        x = [dataset.xy(0, column)[0] for column in range(dataset.width)]
        y = [dataset.xy(row, 0)[1] for row in range(dataset.height)]
    if y[0] > y[-1]:
        y, heights = y[::-1], heights[::-1]
    rows = [[None if np.isnan(height) else height for height in row] for row in heights.tolist()]
    return {"file": path.name, "x_m": x, "y_m": y, "heights_m": rows}


def variants():
    """Names and options of files that have heights in metres."""
    layouts = {"strips": STRIPS, "tiles": TILES}
    for layout, compress, predictor, dtype in itertools.product(
        layouts, ("none", "deflate", "lzw", "packbits"), (1, 2, 3), ("float32", "float64", "int16")
    ):
        is_float = dtype.startswith("float")
        if predictor > 1 and (compress in ("none", "packbits") or (predictor == 3 and not is_float)):
            continue
        options = {"compress": compress, **layouts[layout]} | ({"predictor": predictor} if predictor > 1 else {})
        yield f"{layout}_{compress}_{predictor}_{dtype}", dtype, options
    for dtype in ("int8", "uint8", "uint16", "int32", "uint32"):
        yield f"type_{dtype}", dtype, {"compress": "deflate", "predictor": 2, **TILES}
    for dtype, predictor in (("float32", 3), ("int16", 2), ("float64", 1)):
        yield f"big_endian_{dtype}", dtype, {"ENDIANNESS": "BIG", "compress": "lzw", "predictor": predictor}
    yield "big_tiff", "float32", {"BIGTIFF": "YES"}
    yield "south_up", "float32", {"transform": SOUTH_UP}
    yield "without_a_coordinate_system", "float32", {"crs": None}
    yield "points", "float32", {"tags": {"AREA_OR_POINT": "Point"}}
    yield "points_south_up", "int16", {"tags": {"AREA_OR_POINT": "Point"}, "transform": SOUTH_UP}
    yield "overviews", "float32", {"driver": "COG", "blocksize": 128, "overview_count": 2}


def main(folder):
    read = []
    for seed, (name, dtype, options) in enumerate(variants()):
        path = folder / f"{name}.tif"
        heights = heights_of(dtype, seed)
        if dtype in ("float32", "float64", "int16") and seed % 2:
            options = {"nodata": NODATA, **options}
            heights[3:9, 20:] = NODATA
        write(path, heights, **options)
        read.append(found(path))
    lowest = float(np.finfo("float32").min)
    for name, nodata in (("lowest_nodata", lowest), ("nan_nodata", float("nan"))):
        heights = heights_of("float32", 99)
        heights[30:, :7] = nodata
        write(folder / f"{name}.tif", heights, nodata=nodata)
        read.append(found(folder / f"{name}.tif"))
    write(folder / "zstd.tif", heights_of("float32", 98), compress="zstd")
    read.append(found(folder / "zstd.tif"))
    plain = heights_of("float32", 100)
    degrees = Affine(1e-5, 0, 9, 0, -1e-5, 48)
    write(folder / "degrees.tif", plain, crs="EPSG:4326", transform=degrees)
    write(folder / "feet.tif", plain, crs="EPSG:2263")
    write(folder / "scaled.tif", plain, scale=(0.125, 0))
    write(folder / "rotated.tif", plain, transform=NORTH_UP @ Affine.rotation(3))
    write(folder / "bands.tif", np.stack([plain, plain]))
    write(folder / "sparse.tif", plain, sparse_ok=True, nodata=NODATA, **TILES)
    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True):
        write(folder / "mask.tif", plain, mask=plain > 0)
    print(json.dumps(read))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
