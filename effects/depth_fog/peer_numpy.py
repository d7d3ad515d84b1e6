#!/usr/bin/python3
# Plain exponential fog in NumPy as a peer of depth_fog (the protocol: src/measure/peer.hpp).
import json
import sys
import time

try:
    import numpy as np
except ImportError:
    print("needs python3-numpy", file=sys.stderr)
    sys.exit(69)

folder = sys.argv[1]
job = json.load(open(folder + "/job.json"))
width, height, camera, p = job["width"], job["height"], job["camera"], job["parameters"]
color = np.fromfile(folder + "/color.f32", np.float32).reshape(height, width, 4)
depth = np.fromfile(folder + "/depth.f32", np.float32).reshape(height, width)
airlight = np.array(p["color"][:3], np.float32)
tint = np.array(p["tint"][:3], np.float32)
contrast = 0.02 if p["measure"] == "meteorological range" else 0.05
beta = np.float32(p["extinction"] if p["measure"] == "extinction" else -np.log(contrast) / p["visibility"])


def fog():
    x = (np.arange(width, dtype=np.float32) + 0.5 - camera["cx"]) / np.float32(camera["fx"])
    y = (np.arange(height, dtype=np.float32) + 0.5 - camera["cy"]) / np.float32(camera["fy"])
    length = np.sqrt(x[None, :] ** 2 + y[:, None] ** 2 + np.float32(1)).astype(np.float32)
    transmittance = np.exp(-(depth * length)[:, :, None] * (beta * tint))
    out = np.empty_like(color)
    out[:, :, :3] = color[:, :, :3] * transmittance + airlight * (1 - transmittance)
    out[:, :, 3] = color[:, :, 3]
    return out


milliseconds = []
for k in range(job["repetitions"] + 1):
    start = time.perf_counter()
    result = fog()
    if k:
        milliseconds.append((time.perf_counter() - start) * 1e3)
result.tofile(folder + "/output.f32")
json.dump({"device": "NumPy " + np.__version__, "milliseconds": milliseconds}, open(folder + "/result.json", "w"))
