#!/usr/bin/python3
# FFmpeg's gblur as a peer of gaussian_blur (the protocol: src/measure/peer.hpp). Its time is the difference between
# runs with and without the filter, over the frames that differ.
import json
import subprocess
import sys
import time

try:
    import numpy as np
    version = subprocess.run(["ffmpeg", "-version"], capture_output=True, text=True, check=True).stdout.split()[2]
except (ImportError, OSError):
    print("needs ffmpeg and python3-numpy", file=sys.stderr)
    sys.exit(69)

folder = sys.argv[1]
job = json.load(open(folder + "/job.json"))
width, height, radius = job["width"], job["height"], job["parameters"]["radius"]
frames = 17

image = np.fromfile(folder + "/color.f32", np.float32).reshape(height, width, 4)
image[:, :, [1, 2, 0]].transpose(2, 0, 1).tofile(folder + "/planes.f32")  # G, B, R
source = ["-f", "rawvideo", "-pix_fmt", "gbrpf32le", "-s", f"{width}x{height}", "-i", folder + "/planes.f32"]
blur = f"gblur=sigma={radius}:steps=1"


def seconds(filters):
    start = time.perf_counter()
    subprocess.run(["ffmpeg", "-v", "error", *source, "-vf", filters, "-f", "null", "-"], check=True)
    return time.perf_counter() - start


loop = f"loop=loop={frames - 1}:size=1"
milliseconds = []
for _ in range(min(5, job["repetitions"])):
    milliseconds.append(max(1e-3, (seconds(f"{loop},{blur}") - seconds(loop)) * 1e3 / frames))
subprocess.run(["ffmpeg", "-v", "error", *source, "-vf", blur, "-f", "rawvideo", "-pix_fmt", "gbrpf32le",
                folder + "/blurred.f32"], check=True)
planes = np.fromfile(folder + "/blurred.f32", np.float32).reshape(3, height, width)
np.dstack([planes[2], planes[0], planes[1], image[:, :, 3]]).astype(np.float32).tofile(folder + "/output.f32")
json.dump({"device": "FFmpeg " + version, "milliseconds": milliseconds}, open(folder + "/result.json", "w"))
