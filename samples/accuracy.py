#!/usr/bin/env python3
"""Writes docs/ACCURACY.md from what `brume chart` measured: no number in it is typed by hand.

Usage: accuracy.py CHARTS_FOLDER TEMPLATE DOCS_FOLDER

In the template, a line of `@effect NAME` becomes that effect's table, `@chart NAME` its picture, `@map NAME CASE | LABEL`
an error map, `@summary`, `@papers` and `@machine` the tables and the line they are named for. Inside a line, {FIELD EFFECT |
CASE | LABEL} is a number of one row: FIELD is ms, copies, worst, rms or p999. A row that is missing is an error.
"""
import csv
import re
import subprocess
import sys
from pathlib import Path

charts, template, docs = Path(sys.argv[1]), Path(sys.argv[2]), Path(sys.argv[3])
pictures = docs / "pictures" / "accuracy"
VISIBLE = 0.5
LISTED = 8  # steps: settings further off are in the charts, not in the tables


def short(x):
    x = float(x)
    if x == 0:
        return "0"
    if abs(x) < 1e-3:
        return f"{x:.0e}".replace("e-0", "e-")
    return f"{x:.3g}" if abs(x) < 1000 else f"{x:.0f}"


def rows_of(effect):
    path = charts / f"{effect}.csv"
    if not path.exists():
        sys.exit(f"accuracy.py: {path} is missing; run brume chart {effect} -o {charts}")
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    for r in rows:
        r["label"] = r["method"] + (f", {r['knob']} {r['value']}" if r["knob"] else "")
        r["runs"] = int(r["runs"])
        for key in ("milliseconds", "quartile_low", "quartile_high", "frame_copy", "worst", "rms", "percentile_99.9"):
            r[key] = float(r[key])
    return [r for r in rows if not r["problem"]]


def copies(r):
    return short(r["milliseconds"] / r["frame_copy"]) if r["frame_copy"] > 0 else "–"


def number(match):
    field, where = match.group(1), [part.strip() for part in match.group(2).split("|")]
    if field in ("change", "shared"):
        return short(paper_mean(paper_rows(), where[0], field))
    effect, case, label = where[0], where[1], where[2]
    for r in rows_of(effect):
        if r["case"] == case and r["label"] == label and r["backend"] in ("cpu", "peer"):
            return {"ms": lambda: short(r["milliseconds"]), "copies": lambda: copies(r), "worst": lambda: short(r["worst"]),
                    "rms": lambda: short(r["rms"]), "p999": lambda: short(r["percentile_99.9"])}[field]()
    sys.exit(f"accuracy.py: {template.name}: no row {where} was measured")


def table(head, lines):
    out = ["| " + " | ".join(head) + " |", "|" + "|".join("---:" if h.startswith("§") else "---" for h in head) + "|"]
    out[0] = out[0].replace("§", "")
    return "\n".join(out + ["| " + " | ".join(line) + " |" for line in lines])


BACKENDS = {"cpu": "CPU", "gl": "OpenGL", "peer": "peer"}


def effect_table(effect):
    rows = rows_of(effect)
    frame = f"{rows[0]['frame']}, {rows[0]['width']}×{rows[0]['height']}"
    shown = [r for r in rows if r["frontier"] == "1" or r["backend"] == "peer"]
    several = len({r["label"] for r in rows if r["backend"] != "peer"}) > 1 and len(shown) < len(rows)
    near = [r for r in shown if r["worst"] <= LISTED or r["backend"] == "peer"]
    left_out = several and len(near) < len(shown)
    shown = near if several else shown
    has_case = any(r["case"] for r in rows)
    has_backends = len({r["backend"] for r in rows if r["backend"] != "peer"}) > 1
    lines = []
    for r in (shown if several else rows):
        name = r["label"] if r["backend"] != "peer" else f"*{r['label']} ({r['device']})*"
        line = [r["case"]] if has_case else []
        line += [name] + ([BACKENDS[r["backend"]]] if has_backends else [])
        line += [f"{short(r['milliseconds'])} ({short(r['quartile_low'])} to {short(r['quartile_high'])})", copies(r),
                 short(r["worst"]), short(r["percentile_99.9"]), short(r["rms"])]
        lines.append(line)
    head = (["case"] if has_case else []) + ["method"] + (["on"] if has_backends else [])
    head += ["§ms (quartiles)", "§frame copies", "§worst", "§99.9 %", "§RMS"]
    what = "What no other setting beats in both time and error" if several else "Every method"
    if any(r["backend"] == "peer" for r in rows):
        what += ", and peers in italics"
    if left_out:
        what += f" (without those off by more than {LISTED} steps)"
    return f"{what}; {frame}:\n\n" + table(head, lines)


def picture(source, width):
    pictures.mkdir(parents=True, exist_ok=True)
    target = pictures / source.name
    palette = f"scale={width}:-1:flags=area,split[a][b];[a]palettegen=max_colors=64[p];[b][p]paletteuse=dither=none"
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", source, "-vf", palette, target], check=True)
    return f"pictures/accuracy/{target.name}"


def chart(effect):
    source = charts / f"{effect}.png"
    width = int.from_bytes(source.read_bytes()[16:20], "big")
    return f"![{effect}: worst error over time]({picture(source, int(width * 0.55))})"


def error_map(argument):
    effect, rest = argument.split(" ", 1)
    case, label = [part.strip() for part in rest.split("|")]
    for r in rows_of(effect):
        if r["case"] == case and r["label"] == label and r["map"]:
            return f"![{effect}, {case}, {label}: where the error is]({picture(charts / r['map'], 480)})"
    return ""  # not on the frontier this time


def summary():
    lines = []
    for path in sorted(charts.glob("*.csv")):
        if not path.open().readline().startswith("effect,case,method,"):
            continue
        rows = rows_of(path.stem)
        for case in dict.fromkeys(r["case"] for r in rows):
            for backend in ("cpu", "gl"):
                mine = [r for r in rows if r["case"] == case and r["backend"] == backend and r["has_reference"] == "1"]
                if not mine:
                    continue
                good = [r for r in mine if r["worst"] <= VISIBLE]
                best = min(good, key=lambda r: r["milliseconds"]) if good else min(mine, key=lambda r: r["worst"])
                lines.append([f"[{path.stem}](#{path.stem})", case, best["label"], BACKENDS[backend], short(best["milliseconds"]),
                              copies(best), short(best["worst"]) + ("" if good else " (visible: the best there is)")])
    return table(["effect", "case", "method", "on", "§ms", "§frame copies", "§worst error"], lines)


def photograph(source):
    pictures.mkdir(parents=True, exist_ok=True)
    target = pictures / f"{source.stem}.jpg"
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", source, "-q:v", "2", target], check=True)
    return f"pictures/accuracy/{target.name}"


def shown(rows):
    """Strips below each other; of pictures, those that the paper has and what they are compared with, side by side."""
    if rows and rows[0]["moves"] == "1":
        return [f"{r['row']}:\n\n![{r['row']}, animated]({photograph(charts / r['picture'])})" for r in rows]
    rows = [r for r in rows if r["printed"] or r["row"] == r["against"]]
    return [table([r["row"] for r in rows], [[f"![{r['row']}]({photograph(charts / r['picture'])})" for r in rows]])] if rows else []


def paper_rows():
    with open(charts / "papers.csv", newline="") as file:
        rows = [r for r in csv.DictReader(file) if not r["problem"]]
    backend = "cpu" if any(r["backend"] == "cpu" for r in rows) else "gl"
    return [r for r in rows if r["backend"] == backend]


def paper_mean(rows, name, key):
    values = [float(r[key]) for r in rows if r["row"] == name]
    return sum(values) / len(values)


def papers():
    rows, out = paper_rows(), []
    backend = rows[0]["backend"]
    for title in dict.fromkeys(r["title"] for r in rows):
        mine = [r for r in rows if r["title"] == title]
        mean = lambda name, key: paper_mean(mine, name, key)
        first = mean(mine[0]["row"], "milliseconds")
        lines = []
        for name in dict.fromkeys(r["row"] for r in mine):
            ms = mean(name, "milliseconds")
            line = [name, next(r["printed"] for r in mine if r["row"] == name), short(ms), short(ms / first)]
            if mine[0]["against"]:
                if name == mine[0]["against"]:
                    line += ["", "", ""]
                else:
                    line += [short(max(float(r["worst"]) for r in mine if r["row"] == name)), short(mean(name, "rms")),
                             short(mean(name, "coarse_rms"))]
            if mine[0]["moves"] == "1":
                line += [short(mean(name, "change")), short(mean(name, "shared"))]
            lines.append(line)
        head = ["", "printed", f"§ms, {BACKENDS[backend]}", "§× first"]
        head += ["§worst", "§RMS", "§RMS of 16×16 means"] if mine[0]["against"] else []
        head += ["§change a frame", "§moves with"] if mine[0]["moves"] == "1" else []
        against = f" Differences are from “{mine[0]['against']}”." if mine[0]["against"] else ""
        out.append(f"### {title}\n\n{mine[0]['paper']}: {mine[0]['measured']}.{against}\n\n{table(head, lines)}")
        out += shown([r for r in mine if r["picture"]])
    return "\n\n".join(out)


def machine():
    devices, copies_of, runs = {}, {}, []
    for path in sorted(charts.glob("*.csv")):
        if path.open().readline().startswith("effect,case,method,"):
            for r in rows_of(path.stem):
                devices[r["device"]] = BACKENDS[r["backend"]]
                runs.append((r["runs"], r["milliseconds"]))
                if r["backend"] == "cpu":
                    copies_of.setdefault(f"{r['width']}×{r['height']}", []).append(r["frame_copy"])
    spread = "; ".join(f"{size} took {short(min(c))} to {short(max(c))} ms" for size, c in sorted(copies_of.items()))
    copy = f" Copying a frame of {spread}, by where its memory lay in that run." if spread else ""
    most = max(n for n, _ in runs)
    short_runs = [ms for n, ms in runs if n < most]
    few = f" Times are medians of {most} runs"
    few += f", of {min(n for n, _ in runs)} or more where a run takes over {short(min(short_runs))} ms." if short_runs else "."
    return "Measured on " + "; ".join(f"{kind}: {device}" for device, kind in sorted(devices.items(), key=lambda d: d[1])) + "." + copy + few


def expand(line):
    word, _, rest = line.partition(" ")
    if word in ("@effect", "@chart", "@map"):
        return {"@effect": effect_table, "@chart": chart, "@map": error_map}[word](rest.strip())
    if word in ("@summary", "@papers", "@machine"):
        return {"@summary": summary, "@papers": papers, "@machine": machine}[word]()
    return re.sub(r"\{(ms|copies|worst|rms|p999|change|shared) ([^}]*)\}", number, line)


text = "\n".join(expand(line) for line in template.read_text().splitlines()) + "\n"
(docs / "ACCURACY.md").write_text(text)
print(f"{docs / 'ACCURACY.md'} is written")
