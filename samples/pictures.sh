#!/usr/bin/env bash
# The README's pictures, from what demo.sh made. Usage: pictures.sh BUILD_FOLDER DEMO_FOLDER OUTPUT_FOLDER
set -euo pipefail
sheet=$1/bin/brume_contact_sheet
demo=$2/pictures
out=$3
mkdir -p "$out"

"$sheet" -o "$out/before_after.jpg" --columns 2 --width 620 \
    "as captured=$demo/forest_day.as_captured.png" "brume apply visibility_200=$demo/forest_day.visibility_200.png"
"$sheet" -o "$out/scenes.jpg" --columns 3 --width 420 \
    "forest_day=$demo/forest_day.as_captured.png" "street_night=$demo/street_night.as_captured.png" \
    "valley=$demo/valley.as_captured.png"
