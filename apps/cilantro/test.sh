#!/usr/bin/env bash
# Tries the program as a user would, the wrong ways included: test.sh CILANTRO QUICKSTART [EMULATOR...]
set -euo pipefail
cilantro=$1 quickstart=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
# Programs for another machine than this are run by what emulates it.
if [ $# -gt 2 ]; then
  for program in "$cilantro" "$quickstart"; do
    printf '#!/bin/bash\nexec %s "$@"\n' "$(printf '%q ' "${@:3}" "$program")" > "emulated_${program##*/}"
  done
  cilantro=$PWD/emulated_${cilantro##*/} quickstart=$PWD/emulated_${quickstart##*/}
  chmod +x "$cilantro" "$quickstart"
fi

fail() { echo "FAILED: $*"; exit 1; }
# expect STATUS WORDS COMMAND...: the status, and words somewhere in what is printed.
expect() {
  local status=0 wanted=$1 words=$2 printed
  shift 2
  printed=$("$@" 2>&1) || status=$?
  [ "$status" = "$wanted" ] || fail "$* ended with $status: $printed"
  [[ "$printed" == *"$words"* ]] || fail "$* did not say \"$words\": $printed"
}

"$quickstart" > /dev/null
cp out/cloud.ply scan.ply

expect 0 'Says what a file holds' "$cilantro" --help
expect 0 'voxel=EDGE' "$cilantro" run --help
expect 0 'points: ' "$cilantro" info scan.ply
expect 0 '"normals": true' "$cilantro" info scan.ply --json
"$cilantro" info scan.ply --json | python3 -c 'import json, sys; assert json.load(sys.stdin)["points"] > 1000'

for ending in pcd xyz csv; do
  expect 0 "points in a.$ending" "$cilantro" convert scan.ply a.$ending
  expect 0 '' "$cilantro" convert a.$ending b.ply --quiet
  "$cilantro" convert b.ply c.$ending --quiet
  cmp a.$ending c.$ending || fail "a cloud changed on its way through $ending"
done
expect 0 '' "$cilantro" convert scan.ply a.pcd --compressed --quiet
expect 0 '' "$cilantro" convert a.pcd b.ply --quiet
cmp scan.ply b.ply || fail 'a cloud changed on its way through compression'
expect 0 'DATA ascii' bash -c "'$cilantro' convert scan.ply t.pcd --ascii && head -20 t.pcd"

# Numbers keep the precision of the file, in all that is done with them.
printf 'ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\nend_header\n0.123456789012 0 0\n1 0 0\n0 1 0\n' > double.ply
for command in 'convert double.ply d.xyz' 'run double.ply invalid -o d.xyz' 'segment double.ply d.xyz --knn 3' \
  'align double.ply double.ply --metric point-to-point -o d.xyz' 'plane double.ply --distance 0.1 --inliers d.xyz'; do
  # shellcheck disable=SC2086 # Words of a command.
  "$cilantro" $command --quiet > /dev/null
  grep -q '^0\.123456789012 ' d.xyz || fail "digits were lost on the way through: $command"
  rm d.xyz
done
"$cilantro" run double.ply random=2:1 uniform=1 -o d.ply --quiet
expect 0 'double x' head -9 d.ply
# A cloud in float beside one in double.
expect 0 'status: "converged"' "$cilantro" align a.xyz scan.ply --voxel 0.03 --max-distance 0.2

expect 0 'normals=knn:10' "$cilantro" run scan.ply invalid voxel=0.05 outliers=20:2.0 normals=knn:10 \
  orient=knn:10 -o out.ply --picture out.png
expect 0 '' "$cilantro" run out.ply crop=-9:-9:-9:9:9:9 stride=3 take=7 --quiet -o few.xyz
[ "$(grep -vc '^#' few.xyz)" = 7 ] || fail 'seven points were not kept'
expect 0 '' "$cilantro" run out.ply random=100:3 farthest=9 uniform=5 lonely=100:1 --quiet -o few.xyz
[ "$(grep -vc '^#' few.xyz)" = 5 ] || fail 'five points were not kept'
head -c 4 out.png | grep -q PNG || fail 'the picture is no PNG file'

# Align a cloud that has been moved, and look at what is said about it.
expect 0 'status: "converged"' "$cilantro" align scan.ply scan.ply --metric point-to-plane --voxel 0.03 --max-distance 0.2
"$cilantro" align scan.ply scan.ply --voxel 0.03 --max-distance 0.2 --json -o moved.ply --picture both.png | python3 -c '
import json, sys
found = json.load(sys.stdin)
assert list(found) == ["transform", "status", "converged", "iterations", "pairs", "overlap", "rmse", "unobservable"]
assert found["converged"] and found["overlap"] == 1 and found["unobservable"] == []
assert len(found["transform"]) == 4 and all(len(row) == 4 for row in found["transform"])'
expect 0 'points: ' "$cilantro" info moved.ply
# A plane slides in itself.
for i in $(seq 0 19); do for j in $(seq 0 19); do echo "$i $j 0"; done; done > plane.xyz
"$cilantro" align plane.xyz plane.xyz --json | python3 -c '
import json, sys
found = json.load(sys.stdin)
assert found["status"] == "degenerate" and not found["converged"] and len(found["unobservable"]) == 3'
sed 's/ 0$/ 900/' plane.xyz > far.xyz
expect 1 'too few pairs' "$cilantro" align far.xyz plane.xyz --max-distance 1
expect 1 'needs colors, and the source has none' "$cilantro" align plane.xyz plane.xyz --metric colored
expect 2 'try --help' "$cilantro" align plane.xyz plane.xyz --metric nonsense
expect 2 'required' "$cilantro" align plane.xyz

# Bend a sheet with a relief onto what it became.
awk 'BEGIN { for (i = 0; i < 41; ++i) for (j = 0; j < 25; ++j) {
  x = i / 40; y = j / 40; z = 0.02 * sin(17 * x) * cos(13 * y)
  print x, y, z > "sheet.xyz"; print x, y, z + 0.1 * x * x > "bent.xyz" } }'
expect 0 'status: "converged"' "$cilantro" warp sheet.xyz bent.xyz --spacing 0.1 --max-distance 0.2 -o warped.xyz --picture warped.png
"$cilantro" warp sheet.xyz bent.xyz --spacing 0.1 --max-distance 0.2 --json -o again.xyz | python3 -c '
import json, sys
found = json.load(sys.stdin)
assert list(found) == ["status", "converged", "iterations", "pairs", "overlap", "rmse", "residual", "energy", "nodes", "unsupported_nodes"]
assert found["converged"] and found["overlap"] == 1 and found["nodes"] > 50 and found["unsupported_nodes"] == 0'
cmp warped.xyz again.xyz || fail 'the same command gave another cloud'
python3 -c '
rows = [[list(map(float, line.split())) for line in open(name) if line[0].isdigit() or line[0] == "-"] for name in ("warped.xyz", "bent.xyz")]
assert len(rows[0]) == len(rows[1]) == 1025
assert max(abs(a[2] - b[2]) for a, b in zip(*rows)) < 0.01'
head -c 4 warped.png | grep -q PNG || fail 'the picture is no PNG file'
printf '0 0\n1024 1024\n' > marks.txt
expect 0 'status: "converged"' "$cilantro" warp sheet.xyz bent.xyz --spacing 0.1 --max-distance 0.2 --landmarks marks.txt
expect 0 'status: ' "$cilantro" warp sheet.xyz bent.xyz --spacing 0.1 --max-distance 0.2 --affine --rigidity 0.1
# A cloud in float onto one in double.
expect 0 'status: ' "$cilantro" warp plane.xyz bent.xyz --spacing 5 --quiet
expect 1 'too few pairs' "$cilantro" warp far.xyz plane.xyz --spacing 5 --max-distance 1
echo '0 1025' > marks.txt
expect 1 'a landmark is not among the points' "$cilantro" warp sheet.xyz bent.xyz --spacing 0.1 --landmarks marks.txt
echo '0 one' > marks.txt
expect 1 'marks.txt: a landmark is two whole numbers' "$cilantro" warp sheet.xyz bent.xyz --spacing 0.1 --landmarks marks.txt
expect 1 'missing.txt: cannot be read' "$cilantro" warp sheet.xyz bent.xyz --spacing 0.1 --landmarks missing.txt
expect 2 'required' "$cilantro" warp sheet.xyz bent.xyz
expect 2 'try --help' "$cilantro" warp sheet.xyz bent.xyz --spacing -1
expect 2 'try --help' "$cilantro" warp sheet.xyz bent.xyz --spacing 0.1 --stiffness -1
expect 2 'try --help' "$cilantro" warp sheet.xyz bent.xyz --spacing 0.1 --rigidity 1

# Segments and planes.
"$cilantro" segment scan.ply parts.ply --knn 30 --angle 8 --min-size 50 --json --picture parts.png | python3 -c '
import json, sys
found = json.load(sys.stdin)
assert found["clusters"] == len(found["sizes"]) >= 3 and found["sizes"] == sorted(found["sizes"], reverse=True)
assert found["sizes"][-1] >= 50'
expect 0 'attribute: {"name":"cluster","type":"int32","min":-1' "$cilantro" info parts.ply
expect 0 'clusters: 1' "$cilantro" segment plane.xyz --quiet
"$cilantro" plane plane.xyz --distance 0.01 --json | python3 -c '
import json, sys
found = json.load(sys.stdin)
assert found == {"normal": [0.0, 0.0, 1.0], "offset": 0.0, "inliers": 400}, found'
sed 's/^0 0 0$/5 5 5/' plane.xyz > bump.xyz
expect 0 'inliers: 399' "$cilantro" plane bump.xyz --distance 0.01 --inliers flat.xyz --others rest.xyz
[ "$(grep -vc '^#' rest.xyz)" = 1 ] || fail 'one point is not of the plane'
echo '0 0 0' > one.xyz
expect 1 'no plane was found' "$cilantro" plane one.xyz --distance 0.01
expect 2 'required' "$cilantro" plane plane.xyz
expect 2 'try --help' "$cilantro" plane plane.xyz --distance -1
expect 2 'try --help' "$cilantro" segment plane.xyz --knn 0

# Pictures.
expect 0 'a picture is in seen.png' "$cilantro" picture scan.ply plane.xyz -o seen.png --size 320,200 --color z --point-size 2 --direction 0,1,-1
head -c 4 seen.png | grep -q PNG || fail 'the picture is no PNG file'
expect 0 '' "$cilantro" picture parts.ply -o seen.png --color label:cluster --orthographic --background 255,255,255 --quiet
expect 0 'a film is in turn.y4m' "$cilantro" picture scan.ply -o turn.y4m --size 64,40 --turntable 3 --frames-per-second 12.5
head -c 31 turn.y4m | grep -q 'YUV4MPEG2 W64 H40 F25:2' || fail 'the film is no YUV4MPEG2 file'
[ "$(stat -c %s turn.y4m)" = $((57 + 3 * (6 + 3 * 64 * 40))) ] || fail 'the film has not three frames'
expect 0 '' "$cilantro" picture scan.ply -o turn%02d.png --size 64,40 --turntable 3 --quiet
[ "$(ls turn??.png)" = $'turn00.png\nturn01.png\nturn02.png' ] || fail 'there are not three frames'
if command -v ffmpeg > /dev/null; then
  # Without standard streams, too.
  "$cilantro" picture scan.ply -o turn.mp4 --size 63,41 --turntable 3 --quiet <&- >&- 2>&- || fail 'there is no film'
  head -c 8 turn.mp4 | grep -q ftyp || fail 'the film is no MP4 file'
fi
expect 1 'turn.mp4 would be a film, which needs --turntable' "$cilantro" picture missing.ply -o turn.mp4
expect 1 'the name of a film ends in' "$cilantro" picture scan.ply -o turn.png --turntable 3
expect 2 'try --help' "$cilantro" picture scan.ply -o turn.png --frames-per-second 3
expect 1 'no attribute "x", but' "$cilantro" picture parts.ply -o seen.png --color attribute:x
expect 1 'the color must be' "$cilantro" picture parts.ply -o seen.png --color blue
expect 1 'missing.ply: cannot be read' "$cilantro" picture missing.ply -o seen.png
expect 0 'a page is in seen.html' "$cilantro" html scan.ply plane.xyz -o seen.html --color z --title 'two <b>'
head -c 15 seen.html | grep -q '<!DOCTYPE html>' || fail 'the page is no HTML file'
grep -q '<title>two &lt;b></title>' seen.html || fail 'the page has another title'
grep -q '"name":"plane.xyz"' seen.html || fail 'the page lacks a layer'
expect 1 'must end in .html' "$cilantro" html scan.ply -o seen.htm
expect 1 'missing.ply: cannot be read' "$cilantro" html missing.ply -o seen.html
expect 0 '' "$cilantro" run plane.xyz normals=knn:8 --html run.html --quiet
expect 0 'clusters' "$cilantro" segment plane.xyz --min-size 10 --html parts.html
expect 0 'overlap' "$cilantro" align scan.ply scan.ply --voxel 0.03 --max-distance 0.2 --html both.html
for page in run parts both; do
  head -c 15 $page.html | grep -q '<!DOCTYPE html>' || fail "$page.html is no page"
done
# What cannot be drawn is said before the work.
rm -f out.xyz
expect 1 'the name must end in .png' "$cilantro" run plane.xyz -o out.xyz --picture seen.jpg
expect 0 '' "$cilantro" run plane.xyz --picture LARGE.PNG --quiet
expect 1 'would be a film' "$cilantro" picture plane.xyz -o turn.MP4
expect 1 'there is no such folder' "$cilantro" run plane.xyz -o out.xyz --html nowhere/seen.html
expect 1 'cilantro html draw into a file' env -u DISPLAY -u WAYLAND_DISPLAY "$cilantro" run plane.xyz -o out.xyz --show --quiet
[ ! -e out.xyz ] || fail 'the work was done in vain'
expect 1 'needs --turntable' "$cilantro" picture plane.xyz -o turn%04d.png
# One range of colours for all clouds, and so one bar.
sed 's/$/ 0/; s/ 0$//' plane.xyz | awk '{print $1, $2, $3 + 50}' > higher.xyz
expect 0 '' "$cilantro" html plane.xyz higher.xyz -o two.html --color z --quiet
[ "$(grep -o '"numbers":\[[^]]*\]' two.html | sort -u | wc -l)" = 1 ] || fail 'a colour means two things'
expect 0 'cilantro 0.1.0' "$cilantro" --version
expect 2 'there is no command movie' "$cilantro" movie
# Without a display, or without windows at all, it says what draws into a file.
expect 1 'picture' env -u DISPLAY -u WAYLAND_DISPLAY "$cilantro" view scan.ply --color z --quiet
expect 2 'try --help' "$cilantro" picture scan.ply -o seen.png --size 0,10
expect 2 'try --help' "$cilantro" picture scan.ply -o seen.png --up 0,0,1

# An odometry: a scan that moves a centimetre at a time, and once out of sight.
"$cilantro" convert scan.ply at.xyz --quiet
for step in 0 1 2 3; do awk -v s="$step" '/^#/ {next} {print $1 + 0.01 * s, $2, $3 - 0.005 * s}' at.xyz > step$step.xyz; done
awk '/^#/ {next} {print $1 + 50, $2, $3}' at.xyz > step9.xyz
expect 0 'step3.xyz: tracked at -0.0' "$cilantro" odometry step0.xyz step1.xyz step2.xyz step3.xyz --voxel 0.03 --map way.ply --poses way.txt --picture way.png
[ "$(wc -l < way.txt)" = 4 ] || fail 'there is not one pose a frame'
expect 0 'points: ' "$cilantro" info way.ply
head -c 4 way.png | grep -q PNG || fail 'the picture is no PNG file'
"$cilantro" odometry step0.xyz step1.xyz step9.xyz step2.xyz --voxel 0.03 --json --threads 1 | python3 -c '
import json, sys
found = json.load(sys.stdin)
assert [frame["status"] for frame in found["frames"]] == ["first", "tracked", "lost", "tracked"], found
assert found["lost"] == 1 and found["map_points"] > 1000, found
for frame, step in zip(found["frames"], (0, 1, None, 2)):
    if step is not None:
        way = [row[3] for row in frame["pose"]][:3]
        assert all(abs(a + step * b) < 2e-3 for a, b in zip(way, (0.01, 0, -0.005))), frame'
expect 1 'no frame lies on the map' "$cilantro" odometry step0.xyz step9.xyz --voxel 0.03
expect 1 'missing.ply: cannot be read' "$cilantro" odometry step0.xyz missing.ply --voxel 0.03
expect 2 'required' "$cilantro" odometry step0.xyz
expect 2 'try --help' "$cilantro" odometry step0.xyz --voxel -1
expect 2 'try --help' "$cilantro" odometry step0.xyz --voxel 1 --min-overlap 2

# From anywhere: a scan that was turned by two radians.
awk '/^#/ {next} {c = cos(2); s = sin(2); print c * $1 - s * $2 + 3, s * $1 + c * $2 - 1, $3 + 0.5}' at.xyz > turned.xyz
"$cilantro" align turned.xyz scan.ply --global 0.1 --voxel 0.03 --max-distance 0.1 --json | python3 -c '
import json, math, sys
found = json.load(sys.stdin)
assert found["global"]["status"] == "unique" and found["status"] == "converged", found
matrix = found["transform"]
assert abs(matrix[0][0] - math.cos(2)) < 1e-3 and abs(matrix[0][1] - math.sin(2)) < 1e-3, matrix'
expect 1 'no transform was found' "$cilantro" align far.xyz scan.ply --global 0.1
expect 2 'try --help' "$cilantro" align turned.xyz scan.ply --global 0
expect 2 'requires' "$cilantro" align turned.xyz scan.ply --viewpoint 0 0 0

# Many scans.
"$cilantro" model scan.ply turned.xyz step2.xyz --voxel 0.1 --cell 0.02 --json -o model.ply --picture model.png | python3 -c '
import json, sys
found = json.load(sys.stdin)
assert found["components"] == 1 and found["pairs"] == 3, found
assert all(edge["verdict"] == "kept" for edge in found["edges"]), found'
expect 0 'points: ' "$cilantro" info model.ply
expect 1 'no two scans fit' "$cilantro" model far.xyz scan.ply --voxel 0.1
expect 2 'required' "$cilantro" model scan.ply

# Tiles.
rm -rf tiles thin halves
expect 0 'points in ' "$cilantro" tile scan.ply -o tiles --edge 1
expect 0 'edge: 1.0' "$cilantro" info tiles
expect 1 'they are complete' "$cilantro" tile scan.ply -o tiles
expect 0 'points, then ' "$cilantro" run tiles voxel=0.05 outliers=8:2 normals=knn:8 -o thin --memory 200
"$cilantro" convert tiles all.ply
"$cilantro" run all.ply voxel=0.05 outliers=8:2 normals=knn:8 -o whole.ply
[ "$("$cilantro" info thin | grep points)" = "$("$cilantro" info whole.ply | grep points)" ] || fail 'tiles have what the whole has'
expect 0 'tiles in halves' "$cilantro" run 'tiles/*_*.ply' voxel=0.05 -o halves --edge 0.5
expect 0 'then 5 in' "$cilantro" run tiles take=5 -o taken
expect 1 'looks at the whole cloud' "$cilantro" run tiles farthest=5 -o farthest
expect 1 'which no tile knows after the step voxel_downsample' "$cilantro" run tiles voxel=0.1 take=5 -o after
expect 2 'needs a folder' "$cilantro" run tiles voxel=1
expect 2 'for folders and patterns' "$cilantro" run scan.ply voxel=1 --resume
expect 1 'more memory' "$cilantro" run tiles voxel=1 -o small --memory 1
expect 1 'there is no file' "$cilantro" tile 'nothing*' -o none

# Hulls.
"$cilantro" hull plane.xyz -o corners.xyz --json | python3 -c '
import json, sys
found = json.load(sys.stdin)
assert found == {"status": "flat", "vertices": 4, "facets": 4, "area": 361.0, "volume": 0.0,
                 "perimeter": 76.0, "centroid": [9.5, 9.5, 0.0], "left_out": 0}, found'
[ "$(grep -vc '^#' corners.xyz)" = 4 ] || fail 'a square has four corners'
expect 0 'status: "bounded"' "$cilantro" hull scan.ply
expect 0 'status: "flat"' "$cilantro" hull plane.xyz -o corners.ply
grep -qa 'element face 2' corners.ply || fail 'a square has two triangles'
expect 0 'points: 4' "$cilantro" info corners.ply

# Crops.
expect 0 '25 of 400 points' "$cilantro" crop plane.xyz -o part.xyz --box 0,0,-1,4,4,1
expect 0 '375 of 400 points' "$cilantro" crop plane.xyz -o rest.xyz --box 0,0,-1,4,4,1 --outside
expect 0 '5 of 400 points' "$cilantro" crop plane.xyz -o part.xyz --ball 10,10,0,1 --box 0,0,-1,19,19,1
expect 0 '5 of 400 points' "$cilantro" crop plane.xyz -o part.xyz --cylinder 10,10,-1,10,10,1,1
expect 0 '11 of 400 points' "$cilantro" crop plane.xyz -o part.xyz --cylinder 5,3,0,15,3,0,0.5
expect 1 'must be finite, and apart' "$cilantro" crop plane.xyz -o part.xyz --cylinder 1,1,1,1,1,1,1
expect 1 'must be positive' "$cilantro" crop plane.xyz -o part.xyz --cylinder 0,0,0,0,0,1,-1
expect 0 '4 of 400 points' "$cilantro" crop plane.xyz -o one.xyz --box 3,3,0,4,4,0
expect 0 '4 of 400 points' "$cilantro" crop plane.xyz -o part.xyz --hull one.xyz
expect 0 '4 of 4 points' "$cilantro" crop one.xyz -o part.xyz --hull plane.xyz --margin 0.1
expect 1 'lower must be at most upper' "$cilantro" crop plane.xyz -o part.xyz --box 1,0,0,0,1,1
expect 1 'must be a number' "$cilantro" crop plane.xyz -o part.xyz --ball nan,0,0,1
expect 1 'must be a number' "$cilantro" crop plane.xyz -o part.xyz --hull one.xyz --margin nan
sed 's/.*/nan nan nan/' one.xyz > none.xyz
expect 1 'no point' "$cilantro" crop plane.xyz -o part.xyz --hull none.xyz
expect 2 'try --help' "$cilantro" crop plane.xyz -o part.xyz
expect 2 'try --help' "$cilantro" crop plane.xyz -o part.xyz --box 1,2,3
expect 2 'try --help' "$cilantro" crop plane.xyz -o part.xyz --box 0,0,0,1,1,1 --margin 1
expect 2 'try --help' "$cilantro" hull plane.xyz --tolerance -1

expect 1 'missing.ply: cannot be read' "$cilantro" info missing.ply
expect 1 'does not end in .ply' "$cilantro" convert scan.ply a.gif
expect 1 'is not a PLY file' bash -c "echo nonsense > bad.ply; '$cilantro' info bad.ply"
expect 2 'there is no step "voxels"' "$cilantro" run scan.ply voxels=1
expect 2 'is written voxel=EDGE' "$cilantro" run scan.ply voxel
expect 2 '"big" in the step "voxel" is no number' "$cilantro" run scan.ply voxel=big
expect 1 'the edges must be positive' "$cilantro" run scan.ply voxel=-1
expect 2 'required' "$cilantro" convert scan.ply
expect 2 'try --help' "$cilantro" frobnicate
[ ! -e a.gif ] || fail 'a file appeared that should not'
echo 'the program does what it says'
