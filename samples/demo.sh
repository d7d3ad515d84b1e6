#!/usr/bin/env bash
# Renders the sample scenes, applies every preset to every one, and puts all of it on a contact sheet.
# Usage: demo.sh BUILD_FOLDER OUTPUT_FOLDER
set -euo pipefail
build=$1
out=$2
bin=$build/bin
here=$(cd "$(dirname "$0")" && pwd)
size=1280x720
mkdir -p "$out/frames" "$out/pictures"

presetName() { sed -n 's/^ *"name": *"\(.*\)",\{0,1\} *$/\1/p' "$1" | head -n 1; }

# Older than any of what it is made from, or missing.
isStale() {  # isStale FILE SOURCE...
    local file=$1 source
    shift
    for source in "$@"; do
        [ "$file" -nt "$source" ] || return 0
    done
    return 1
}

scenes=(forest_day street_night valley)
declare -A sceneTitles=([forest_day]="A clearing by day" [street_night]="A wet street at night" [valley]="A mountain valley")
for scene in "${scenes[@]}"; do
    if isStale "$out/frames/$scene.json" "$bin/brume_scenes"; then
        "$bin/brume_scenes" --scene "$scene" --size $size -o "$out/frames" >/dev/null
    fi
done

cat >"$out/as_captured.json" <<'JSON'
{
  "name": "as captured",
  "effects": []
}
JSON
touch -r "$here/demo.sh" "$out/as_captured.json"
presets=("$out/as_captured.json" "$here"/presets/*.json)
effects=("$build"/lib/brume/effects/*/*)
failed=()
for preset in "${presets[@]}"; do
    name=$(basename "$preset" .json)
    stale=()
    for scene in "${scenes[@]}"; do
        isStale "$out/pictures/$scene.$name.png" "$out/frames/$scene.json" "$preset" "$bin/brume" \
            "$build/lib/libbrume.so" "${effects[@]}" && stale+=("$out/frames/$scene.exr")
    done
    [ ${#stale[@]} -eq 0 ] && continue
    echo "applying $name"
    "$bin/brume" apply "$preset" "${stale[@]}" -o "$out/pictures/{stem}.$name.png" >/dev/null || failed+=("$name")
done

items=()
for scene in "${scenes[@]}"; do
    items+=("# ${sceneTitles[$scene]}")
    for preset in "${presets[@]}"; do
        picture=$out/pictures/$scene.$(basename "$preset" .json).png
        [ -f "$picture" ] && items+=("$(presetName "$preset")=$picture")
    done
done
isStale "$out/contact_sheet.jpg" "$here/demo.sh" "${items[@]#*=}" 2>/dev/null &&
    "$bin/brume_contact_sheet" -o "$out/contact_sheet.jpg" --title "brume: every preset on every scene" \
    --columns 5 --width 400 "${items[@]}"

cat <<TEXT

The demo is in $out:
  contact_sheet.jpg   every preset on every scene
  pictures/           each picture by itself; *.as_captured.png is the frame before
  frames/             the captured frames: colour (.exr), device depth (.depth.exr), camera and lights (.json)

Try next:
  $bin/brume apply visibility_200 $out/frames/valley.exr -o fogged.png
  $bin/brume apply depth_fog $out/frames/valley.exr --set depth_fog.visibility=300,1000,3000 --format png -o $out/sweep/
  $bin/brume_scenes --scene street_night --frames 48 -o $out/walk
  $bin/brume list
TEXT
if [ ${#failed[@]} -gt 0 ]; then
    echo "demo: these presets failed: ${failed[*]}" >&2
    exit 1
fi
