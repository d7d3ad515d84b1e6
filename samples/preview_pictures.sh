#!/usr/bin/env bash
# The README's pictures of the preview window. Usage: preview_pictures.sh BUILD_FOLDER DEMO_FOLDER OUTPUT_FOLDER
set -euo pipefail
brume=$1/bin/brume
frames=$2/frames
out=$3
settings=$(mktemp -d)
trap 'rm -rf "$settings"' EXIT
mkdir -p "$out" "$settings/brume"

picture() {  # picture NAME TAB ARGUMENT...
    local name=$1
    echo "{\"tab\": \"$2\", \"probe\": false}" >"$settings/brume/preview.json"
    shift 2
    XDG_CONFIG_HOME=$settings xvfb-run -a -s "-screen 0 1280x800x24" \
        "$brume" preview "$@" --size 1200x720 --screenshot "$out/$name.jpg"
}
picture preview_wipe Effects "$frames/forest_day.exr" visibility_100 --show wipe
picture preview_timing Timing "$frames/street_night.exr" spirit_night
