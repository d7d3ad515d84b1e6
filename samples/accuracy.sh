#!/usr/bin/env bash
# Measures what docs/ACCURACY.md reports, a piece an effect, and writes that page from the tables.
# Usage: accuracy.sh BUILD_FOLDER OUTPUT_FOLDER DOCS_FOLDER
# Pieces that are there already are kept: remove the output folder to measure anew. Nothing else should run meanwhile;
# BRUME_ALONE may name a command that sees to it ("chrt -f 50", say) and is put before each measurement.
set -euo pipefail
build=$1
out=$2
docs=$3
here=$(cd "$(dirname "$0")" && pwd)
brume=$build/bin/brume
read -ra alone <<<"${BRUME_ALONE-}"
backends=${BRUME_ACCURACY_BACKENDS-cpu}
mkdir -p "$out/frames" "$out/small"

for scene in forest_day street_night valley; do
    [ -f "$out/frames/$scene.exr" ] || "$build/bin/brume_scenes" --scene "$scene" --size 1280x720 -o "$out/frames"
done
[ -f "$out/small/forest_day.exr" ] || "$build/bin/brume_scenes" --scene forest_day --size 640x360 -o "$out/small"

chart() {  # chart EFFECT FRAME PIXELS
    [ -f "$out/charts/$1.csv" ] && return
    echo "measuring $1"
    "${alone[@]}" "$brume" chart "$1" -o "$out/charts" --frame "$2" --pixels "$3" --backend "$backends" --seconds .5
}
# Fog needs distance, lights need lamps; references of many steps are asked at fewer pixels.
chart depth_fog "$out/frames/valley.exr" 14400
chart height_fog "$out/frames/forest_day.exr" 3600
chart noise_fog "$out/frames/forest_day.exr" 3600
chart volume_fog "$out/small/forest_day.exr" 1600
chart gaussian_blur "$out/frames/street_night.exr" 3600
chart bessel_blur "$out/frames/street_night.exr" 3600
chart fog_blur "$out/frames/valley.exr" 3600
chart light_detect "$out/frames/street_night.exr" 14400
chart blend "$out/frames/valley.exr" 14400
chart debug_depth "$out/frames/valley.exr" 14400
if [ ! -f "$out/charts/papers.csv" ]; then
    echo "measuring the papers' experiments"
    "${alone[@]}" "$brume" chart --papers -o "$out/charts" --backend "$backends" \
        --frame "$out/frames/forest_day.exr" --frame "$out/frames/valley.exr"
fi
python3 "$here/accuracy.py" "$out/charts" "$here/accuracy.md.in" "$docs"
