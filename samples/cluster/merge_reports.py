#!/usr/bin/env python3
"""Puts the reports of a run's shards together: merge_reports.py REPORT... > report.json"""
import json
import sys


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    reports = []
    for name in sys.argv[1:]:
        with open(name, encoding="utf-8") as file:
            reports.append(json.load(file))
    frames = sorted((frame for report in reports for frame in report["frames"]),
                    key=lambda frame: (frame["index"], frame["output"]))
    outputs = [frame["output"] for frame in frames]
    twice = {output for output in outputs if outputs.count(output) > 1} if len(set(outputs)) < len(outputs) else set()
    if twice:
        sys.exit(f"merge_reports: in more than one report: {', '.join(sorted(twice))}")
    summaries = [report["summary"] for report in reports]
    summary = {key: sum(s[key] for s in summaries) for key in ("made", "up_to_date", "failed", "megapixels")}
    summary["seconds"] = max(s["seconds"] for s in summaries)
    summary["peak_bytes"] = max(s["peak_bytes"] for s in summaries)
    run = {}  # version, preset, seed and the like: as all say, or what each says
    for key in (key for key in reports[0] if key not in ("frames", "summary")):
        said = [report.get(key) for report in reports]
        run[key] = said[0] if all(one == said[0] for one in said) else said
    json.dump({**run, "frames": frames, "summary": summary}, sys.stdout, indent=1)
    print()


main()
