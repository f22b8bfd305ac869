#!/bin/sh
# Behaviour of the command line tools: exit codes, which files are written and which are not, the
# same bytes for any number of threads. BUILD names the folder with the programs.
cd "$(dirname "$0")/.." || exit 1
BUILD=$(cd "${BUILD:-build}" && pwd) || exit 1
T=$BUILD/test_tool.tmp
rm -rf "$T"
mkdir -p "$T"
cd "$T" || exit 1 # where files about defects go
trap 'rm -rf "$T"' EXIT
passed=0
failed=0
mesh=$BUILD/mesh
delaunay=$BUILD/delaunay
improve=$BUILD/improve

ok() { # NAME COMMAND...: the command must succeed
    name=$1
    shift
    if "$@" > "$T/log" 2>&1; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "failed: $name: $*"
        head -n 5 "$T/log"
    fi
}

code() { # EXPECTED COMMAND...: the command must exit with this status; its output is in $T/out, $T/err
    expected=$1
    shift
    "$@" > "$T/out" 2> "$T/err"
    got=$?
    if [ "$got" -eq "$expected" ]; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "failed: exit $got, not $expected: $*"
        head -n 5 "$T/err"
    fi
}
says() { ok "message has '$1'" grep -q "$1" "$T/err"; }
prints() { ok "output has '$1'" grep -q "$1" "$T/out"; }
absent() { for f; do ok "$f is not there" test ! -e "$f"; done; }

# ---- models ----
cube() { # X0 Y0 Z0 SIZE FIRST: vertices and triangles of a cube as OFF lines, kept apart by v and f
    awk -v x="$1" -v y="$2" -v z="$3" -v s="$4" -v o="$5" 'BEGIN {
        for (i = 0; i < 8; i++) print "v", x + s * (i % 2), y + s * (int(i / 2) % 2), z + s * int(i / 4)
        n = split("0 2 3 0 3 1 4 5 7 4 7 6 0 1 5 0 5 4 2 6 7 2 7 3 0 4 6 0 6 2 1 3 7 1 7 5", a, " ")
        for (i = 1; i <= n; i += 3) print "f", 3, a[i] + o, a[i + 1] + o, a[i + 2] + o
    }'
}
off() { # reads v and f lines, writes OFF
    awk '$1 == "v" { v[nv++] = $2 " " $3 " " $4 } $1 == "f" { f[nf++] = $2 " " $3 " " $4 " " $5 }
         END { print "OFF"; print nv, nf, 0; for (i = 0; i < nv; i++) print v[i]; for (i = 0; i < nf; i++) print f[i] }'
}
grid() { # N: a cube of edge N, every face a grid of N x N squares
    awk -v n="$1" 'function id(x, y, z) {
        key = x " " y " " z
        if (!(key in number)) { number[key] = count++; print "v", x, y, z }
        return number[key]
    }
    function square(a, b, c, d) { print "f 3", a, b, c; print "f 3", a, c, d }
    BEGIN {
        for (i = 0; i < n; i++) for (j = 0; j < n; j++) {
            square(id(i, j, 0), id(i, j + 1, 0), id(i + 1, j + 1, 0), id(i + 1, j, 0))
            square(id(i, j, n), id(i + 1, j, n), id(i + 1, j + 1, n), id(i, j + 1, n))
            square(id(i, 0, j), id(i + 1, 0, j), id(i + 1, 0, j + 1), id(i, 0, j + 1))
            square(id(i, n, j), id(i, n, j + 1), id(i + 1, n, j + 1), id(i + 1, n, j))
            square(id(0, i, j), id(0, i, j + 1), id(0, i + 1, j + 1), id(0, i + 1, j))
            square(id(n, i, j), id(n, i + 1, j), id(n, i + 1, j + 1), id(n, i, j + 1))
        }
    }'
}
cube 0 0 0 1 0 | off > "$T/cube.off"
grid 5 | off > "$T/grid.off"
cube 0 0 0 1 0 | sed '$d' | off > "$T/open.off"
{ cube 0 0 0 1 0; cube 0.5 0.25 0.125 1 8; } | off > "$T/overlap.off"
{ cube 0 0 0 3 0; cube 1 1 1 1 8; } | off > "$T/nested.off"
{ cube 0 0 0 1 0; echo 'f 3 0 2 3'; } | off > "$T/twice.off"
{ cube 0 0 0 1 0; echo 'v 0.5 0.5 0.5'; } | off > "$T/unused.off"
{ for z in 0 1; do printf '2 0 %d\n2 1 %d\n1 1 %d\n1 2 %d\n0 2 %d\n0 0 %d\n' $z $z $z $z $z $z; done; } > "$T/corners"
{ printf 'OFF\n12 8 0\n'; cat "$T/corners"; printf '6 5 4 3 2 1 0\n6 6 7 8 9 10 11\n'
  for i in 0 1 2 3 4 5; do echo 4 $i $(((i + 1) % 6)) $(((i + 1) % 6 + 6)) $((i + 6)); done; } > "$T/angle.off"
sed '3s/.*/-1.#IND 0 0/' "$T/cube.off" > "$T/nan.off"
printf 'OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n' > "$T/index.off"
printf 'OFF\n4000000000 1 0\n0 0 0\n' > "$T/huge.off"
printf 'OFF\n0 0 0\n' > "$T/none.off"
: > "$T/empty.stl"
awk 'BEGIN { for (i = 0; i < 216; i++) print i % 6, int(i / 6) % 6, int(i / 36) }' > "$T/grid.xyz"
awk 'BEGIN { for (i = 0; i < 36; i++) print i % 6, int(i / 6), 1 }' > "$T/flat.xyz"
awk 'BEGIN { for (i = 0; i < 9; i++) print i, 2 * i, -i }' > "$T/line.xyz"
printf '1 2 3\n1 2 3\n' > "$T/same.xyz"
printf '0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 0\n1 0 0\n' > "$T/double.xyz"

# ---- usage ----
code 0 $mesh --help
prints 'exit codes'
code 0 $mesh --version
code 2 $mesh
says 'try --help'
code 2 $mesh "$T/cube.off" --bogus
says 'bogus'
code 2 $mesh "$T/cube.off" --size
says 'size needs a number above 0; try'
code 2 $mesh "$T/cube.off" --size -1
says "size needs a number above 0, not '-1'"
code 2 $mesh "$T/cube.off" --region-size 0=1
says 'N=H, a number from 1 to 65535'
code 2 $mesh "$T/cube.off" --format vtu
code 2 $mesh "$T/cube.off" --size 0x10
code 2 $mesh "$T/cube.off" --threads 0
code 2 $mesh "$T/cube.off" --regions some
code 2 $mesh "$T/cube.off" other.off
says "'other.off' is one file too many"
code 0 $mesh "$T/cube.off" --gradation 1 -q
code 2 $mesh "$T/cube.off" -o "$T/a.off"
code 2 $mesh "$T/cube.off" -o "$T/a"
code 2 $mesh --demo "$T/cube.off"
absent "$T/a.off" "$T/a"

# ---- files that cannot be read ----
code 3 $mesh "$T/missing.off" -o "$T/a.mesh"
says 'missing.off'
code 3 $mesh "$T/grid.pdf" -o "$T/a.mesh"
code 3 $mesh "$T/index.off" -o "$T/a.mesh"
says 'line 6'
code 3 $mesh "$T/huge.off" -o "$T/a.mesh"
code 3 $mesh "$T/empty.stl" -o "$T/a.mesh"
absent "$T/a.mesh" "$T/a.mesh.part"

# ---- output that cannot be written ----
code 4 $mesh "$T/cube.off" -o "$T/no/such/folder/a.mesh"
says 'no/such/folder'
code 4 $mesh "$T/cube.off" --json "$T/no/such/folder/a.json"
mkdir "$T/folder.vtu"
code 4 $mesh "$T/cube.off" --size 1e-9 -o "$T/folder.vtu" # at once, not at the end
says 'it is a folder'
if [ -w /dev/full ]; then
    code 4 $mesh "$T/cube.off" -o /dev/full --format mesh
    for tool in $mesh $delaunay $improve; do
        code 4 sh -c '"$0" --help > /dev/full' "$tool"
        says 'standard output'
    done
    code 4 sh -c '"$0" "$1" > /dev/full' $mesh "$T/cube.off"
    code 4 sh -c '"$0" "$1" > /dev/full' $delaunay "$T/grid.xyz"
fi

# ---- one file in the place of another ----
cp "$T/cube.off" "$T/keep.off"
ln -s keep.off "$T/link.off"
code 2 $mesh "$T/keep.off" --json "$T/keep.off"
says 'written over'
code 2 $mesh "$T/keep.off" --json "$T/link.off"
code 2 $mesh "$T/keep.off" -o "$T/one.mesh" --json "$T/one.mesh"
absent "$T/one.mesh"
code 2 $delaunay "$T/grid.xyz" -o "$T/one.mesh" --hull "$T/one.mesh"
code 2 $improve "$T/one.mesh" --bad "$T/one.mesh"
absent "$T/one.mesh"
ok "the input is as it was" cmp -s "$T/cube.off" "$T/keep.off"
code 2 $mesh "$T/cube.off" -q -o "$T/fresh.mesh" --json "$T/./fresh.mesh"
absent "$T/fresh.mesh"
code 0 $mesh "$T/cube.off" -q -o "$T/known.mesh"
code 2 $improve "$T/known.mesh" -q -o "$T/fresh.mesh" --bad "$T/./fresh.mesh"
code 2 $delaunay "$T/known.mesh" -q -o "$T/fresh.mesh" --hull "$T/./fresh.mesh"
absent "$T/fresh.mesh"
code 0 $improve "$T/known.mesh" --bad /dev/stdout
ok "a list to the output is all there is on it" sh -c "head -n 1 '$T/out' | grep -q ',' && ! grep -q tetrahedra '$T/out'"
printf '4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n' > "$T/part.node"
printf '0 3 0 0\n4 0\n1\n3 1 2 3\n1\n3 1 2 4\n1\n3 1 3 4\n1\n3 2 3 4\n0\n' > "$T/part.poly"
cp "$T/part.node" "$T/keep.node"
code 2 $mesh "$T/part.poly" -q -o "$T/part.ele"
says 'written over'
ok "the nodes of the input are as they were" cmp -s "$T/part.node" "$T/keep.node"
code 0 $mesh "$T/part.poly" -q -o "$T/part.1.ele"
cp "$T/part.1.node" "$T/keep.node"
code 2 $mesh "$T/part.1.ele" --check --json "$T/part.1.node"
says 'written over'
code 2 $mesh "$T/cube.off" --size-mesh "$T/part.1.ele" --json "$T/part.1.node"
code 2 $improve "$T/part.1.ele" -q --json "$T/part.1.node"
code 2 $improve "$T/part.1.ele" -q --bad "$T/part.1.node"
ok "the nodes beside the input are as they were" cmp -s "$T/part.1.node" "$T/keep.node"
for what in node face; do
    code 2 $mesh "$T/cube.off" -q -o "$T/new.ele" --json "$T/new.$what"
    code 2 $improve "$T/known.mesh" -q -o "$T/new.ele" --json "$T/new.$what"
    code 2 $improve "$T/known.mesh" -q -o "$T/new.ele" --bad "$T/new.$what"
    code 2 $delaunay "$T/known.mesh" -q -o "$T/new.ele" --hull "$T/new.$what"
    absent "$T/new.$what"
done
cp "$T/part.node" "$T/keep.node"
code 2 $delaunay "$T/part.node" -q -o "$T/part.ele"
says 'written over'
code 2 $delaunay "$T/part.node" -q --hull "$T/part.ele"
says 'written over'
ok "the points are as they were" cmp -s "$T/part.node" "$T/keep.node"
code 2 $delaunay "$T/part.node" -q --hull "$T/part.ply"
says 'no format for triangles'
code 4 $mesh "$T/cube.off" -q -o /dev/null --format ele
says 'a file for each kind'
mkdir -p "$T/fold.er"
code 0 $mesh "$T/cube.off" -q -o "$T/fold.er/out" --format ele
ok "files of a set go into its folder" test -f "$T/fold.er/out.node" -a -f "$T/fold.er/out.face"
code 0 $mesh "$T/cube.off" -o /dev/stdout --format mesh
ok "a mesh to the output is all there is on it" sh -c "head -n 1 '$T/out' | grep -q '^MeshVersion'"
cp "$T/cube.off" "$T/$(printf 'n\303\251\377.off')"
code 0 $mesh "$T/$(printf 'n\303\251\377.off')" -q --json "$T/name.json"
ok "JSON is UTF-8" grep -q "$(printf 'n\303\251.ufffd.off')" "$T/name.json"
code 2 $delaunay "$T/cube.off" --hull "$T/hull.node"
ok "output and statistics may go to one device" $mesh "$T/cube.off" -q -o /dev/null --format mesh --json /dev/null

# ---- surfaces that bound nothing, or meet themselves ----
cat > "$T/hex.vtk" << 'END'
# vtk DataFile Version 3.0
one hexahedron
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 8 float
0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1
CELLS 1 9
8 0 1 2 3 4 5 6 7
CELL_TYPES 1
12
END
code 5 $mesh "$T/hex.vtk"
says 'no triangles.*kinds are not read'
cube 0 0 0 1 1 | awk '$1 == "f" { $2 = "" } { print } END { print "l 1 8\nl 2 3\np 1" }' > "$T/lines.obj"
code 0 $mesh "$T/lines.obj"
prints 'notes  *3 x point, line or other element of a kind that is not read'
{ cube 0 0 0 1 0; echo 'f 2 0 7'; echo 'f 1 3'; } | off > "$T/thin.off"
code 0 $mesh "$T/thin.off"
prints 'notes  *2 x face of fewer than three corners, not read'
for bad in open overlap nan none; do
    code 5 $mesh "$T/$bad.off" -o "$T/$bad.mesh"
    ok "$bad: a sentence" test -s "$T/err"
    absent "$T/$bad.mesh" "$T/$bad.mesh.part"
done
code 5 $mesh "$T/nan.off"
says 'vertex 0'
ok "findings of the overlap" test -s "$T/overlap.defects.vtu"
code 5 $mesh --check "$T/overlap.off" -o "$T/c.mesh"
ok "findings are in a file of their own" test -s "$T/c.defects.vtu"
absent "$T/c.mesh"
code 0 $mesh --check "$T/cube.off"
prints 'none'
code 0 $mesh --check "$T/twice.off"

# ---- meshes ----
code 0 $mesh "$T/cube.off" -o "$T/cube.mesh"
prints 'tetrahedra'
prints 'gamma'
ok "the cube's first vertex" test "$(sed -n 5p "$T/cube.mesh")" = "0 0 0 0"
ok "complete" grep -q '^End$' "$T/cube.mesh"
absent "$T/cube.mesh.part"
code 0 $mesh "$T/cube.off" -q -o "$T/cube.vtu"
ok "-q is quiet" test ! -s "$T/out"
for format in meshb msh msh4 vtk vtu inp ele; do
    code 0 $mesh "$T/cube.off" --size 0.5 -q -o "$T/c.$format"
    ok "$format is there" test -s "$T/c.$format"
    [ $format = vtk ] || [ $format = vtu ] || code 0 $improve "$T/c.$format" -q -o "$T/i.mesh"
done
code 0 $mesh "$T/twice.off" -q -o "$T/twice.mesh"
code 0 $mesh "$T/nested.off" --json "$T/nested.json"
prints 'in 2 regions'
ok "JSON" grep -q '"cells": 2' "$T/nested.json"
code 0 $mesh "$T/nested.off" --regions parity --json "$T/nested.json"
ok "JSON" grep -q '"cells": 1' "$T/nested.json"
code 5 $mesh "$T/open.off" -q --json "$T/open.json"
says 'it is open, at edge .* and 2 others'
ok "JSON after a failure" grep -q '"exit_code": 5' "$T/open.json"
ok "JSON has the place of each finding" test "$(grep -c '"kind": ".*"defect": true, "triangles": \[[0-9]' "$T/open.json")" -gt 0
{ printf '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 7 "outer skin"\n'
  printf '3 1 "steel"\n1 3 "a seam"\n$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n'
  printf '3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n4\n1 2 2 7 1 1 3 2\n2 2 2 7 1 1 2 4\n'
  printf '3 2 2 7 1 2 3 4\n4 2 2 7 1 1 4 3\n$EndElements\n'; } > "$T/named.msh"
for format in msh msh4; do
    for kind in --ascii --binary; do
        code 0 $mesh "$T/named.msh" -q -o "$T/name.$format" $kind
        ok "the name of a group of triangles stays" grep -aq '^2 7 "outer skin"' "$T/name.$format"
        ok "that of other tetrahedra does not" sh -c "! grep -aq steel '$T/name.$format'"
        code 0 $mesh "$T/name.$format" -q -o "$T/again.msh"
        ok "it is read again" grep -q '^1 3 "a seam"' "$T/again.msh"
    done
done
# two cubes of tetrahedra, apart; their regions are 8 and -4
tets() { # X FIRST TAG: the six tetrahedra of a cube
    awk -v o="$2" -v t="$3" 'BEGIN {
        n = split("1 2 4 8 1 4 3 8 1 3 7 8 1 7 5 8 1 5 6 8 1 6 2 8", a, " ")
        for (i = 1; i <= n; i += 4) print a[i] + o, a[i + 1] + o, a[i + 2] + o, a[i + 3] + o, t
    }'
}
{ printf 'MeshVersionFormatted 2\nDimension 3\nVertices\n16\n'
  for x in 0 5; do for i in 0 1 2 3 4 5 6 7; do
      echo $((x + i % 2)) $((i / 2 % 2)) $((i / 4)) 0; done; done
  printf 'Tetrahedra\n12\n'; tets 0 0 8; tets 5 8 -4; printf 'End\n'; } > "$T/tets.mesh"
code 0 $mesh "$T/tets.mesh" --size 0.5 -v
prints 'regions     8: volume 1$'
prints '9: volume 1$'
prints '1 of the regions got numbers'
cube 0 0 0 3 0 > "$T/shells"
cube 1 1 1 1 8 >> "$T/shells"
off < "$T/shells" > "$T/shells.off"
code 0 $mesh "$T/shells.off" --regions parity --no-refine -q -o "$T/hollow.mesh"
code 0 $mesh "$T/hollow.mesh" -v --no-refine
prints '1: volume 26$'
prints 'cell without a seed, left out'
code 0 $mesh "$T/hollow.mesh" -v --no-refine --regions all
prints '2: volume 1$'
code 0 $mesh --demo --order 2 -q -o "$T/second.msh" --save-sizes "$T/second.sol"
code 0 $mesh "$T/cube.off" --size-mesh "$T/second.msh" -q
code 0 $improve "$T/second.msh" -q -o "$T/first.msh"
says 'nodes in the middle of elements'
ok "of them none is written" test "$(sed -n '/^.Nodes/{n;p;}' "$T/first.msh")" -lt \
    "$(sed -n '/^.Nodes/{n;p;}' "$T/second.msh")"
code 0 $mesh "$T/first.msh" --no-refine -q -o "$T/first.mesh"
code 0 $mesh "$T/cube.off" --size 0.3 --no-improve -q -o "$T/raw.mesh"
code 0 $improve "$T/raw.mesh" --json -
prints '"exit_code": 0'
prints '"before": {"tets": [1-9]'
prints '"after": {"tets": [1-9]'
code 2 $improve "$T/raw.mesh" --json "$T/raw.mesh"
code 4 $improve "$T/raw.mesh" --json "$T/no/such/folder/a.json"
code 3 $improve "$T/missing.mesh" --json "$T/a.json"
ok "JSON says what could not be read" grep -q '"exit_code": 3, "message": "cannot open' "$T/a.json"
code 5 $mesh "$T/open.off" -q --json -
prints '"exit_code": 5'
code 0 $mesh "$T/cube.off" -o - --format mesh
prints '^Tetrahedra'
absent ./-
code 2 $mesh "$T/cube.off" -o - --format bogus
says "in the format 'bogus'"
code 2 $mesh "$T/cube.off" -o "$T/both.vtu" --ascii --binary
code 7 $mesh "$T/cube.off" -q --size 1e-9
says 'the sizes ask for about'
code 0 $mesh "$T/cube.off" --no-refine --json "$T/small.json"
ok "no new vertices in a cube" grep -q '"vertices": 8' "$T/small.json"
code 0 $mesh "$T/angle.off"
prints '20 triangles'
code 0 $mesh "$T/unused.off" --no-refine
prints 'tetrahedra  12 '
code 0 $mesh "$T/unused.off" --no-refine --drop-unused -o "$T/used.mesh"
prints 'left out'
prints '1 of INPUT left out'
ok "its node is not written" test "$(sed -n '/^Vertices/{n;p;}' "$T/used.mesh")" = 8
# vertex 8 on edge 0-1, of which only one triangle has it: a gap, or a collinear triangle in it
parted_edge() {
    cube 0 0 0 1 0 | grep -v '^f 3 0 3 1$'
    printf 'v 0.5 0 0\nf 3 0 3 8\nf 3 8 3 1\n'
}
parted_edge | off > "$T/parted_edge.off"
{ parted_edge; echo 'f 3 0 8 1'; } | off > "$T/cap.off"
for parted in parted_edge cap; do
    code 5 $mesh "$T/$parted.off"
    says 'split-edges may mend this'
    code 0 $mesh "$T/$parted.off" --split-edges --no-refine -o "$T/whole.mesh"
    prints 'split       1 triangles cut'
    ok "fourteen triangles" test "$(sed -n '/^Triangles/{n;p;}' "$T/whole.mesh")" = 14
done
prints '1 collinear ones left out'
# the numbers in messages are those of the file, not of what the triangles are cut into
{ parted_edge; echo 'v 0.5 -1 2'; echo 'f 3 4 5 9'; } | off > "$T/numbers.off"
code 5 $mesh "$T/numbers.off" --split-edges --json "$T/numbers.json"
says 'triangle 13 lies outside every cell'
prints 'triangle 13 lies outside every cell'
ok "and in the file" grep -q 'outside every cell", "defect": true, "triangles": .13.' "$T/numbers.json"
ok "with their number" grep -q '"input_triangles": 14,' "$T/numbers.json"
# vertices 8 and 9 on edge 0-1 and 10 on edge 1-5, all of triangle 0 1 5
{ cube 0 0 0 1 0 | grep -v '^f 3 0 3 1$' | grep -v '^f 3 1 7 5$'
  printf 'v 0.25 0 0\nv 0.5 0 0\nv 1 0 0.5\nf 3 0 3 8\nf 3 8 3 9\nf 3 9 3 1\n'
  printf 'f 3 1 7 10\nf 3 10 7 5\n'; } | off > "$T/three.off"
code 0 $mesh "$T/three.off" --split-edges --no-refine -o "$T/whole.mesh"
ok "eighteen triangles" test "$(sed -n '/^Triangles/{n;p;}' "$T/whole.mesh")" = 18
{ cube 0 0 0 1 0; echo 'v 0.5 -1 -1'; echo 'f 3 0 1 8'; } | off > "$T/fin.off"
code 5 $mesh "$T/fin.off"
says 'triangle 12 lies outside every cell.*drop-outside'
code 0 $mesh "$T/fin.off" --drop-outside --drop-unused -o "$T/fin.mesh"
prints '1 x triangle outside every cell, left out'
ok "its triangle is not written" test "$(sed -n '/^Triangles/{n;p;}' "$T/fin.mesh")" = 12
{ cube 0 0 0 1 0; echo 'v 1e-15 1e-15 1e-15'; } | off > "$T/close.off"
code 0 $mesh "$T/close.off"
prints 'practically flat: its vertices [08] and [08], at'
prints 'drop-unused leaves'
code 0 $mesh "$T/cube.off" --no-refine --size 0.1
prints 'the sizes have no effect'
code 7 $mesh --demo 3 --max-memory 1
says 'max-memory allows 1 MB'
code 0 $mesh "$T/grid.off" -q -o "$T/t1.mesh" --threads 1
code 0 $mesh "$T/grid.off" -q -o "$T/t3.mesh" --threads 3
ok "same bytes for any number of threads" cmp "$T/t1.mesh" "$T/t3.mesh"
code 1 $mesh "$T/grid.off" --size 0.3 --no-improve --max-vertices 200 -q -o "$T/budget.mesh"
ok "a budget leaves a mesh" grep -q '^End$' "$T/budget.mesh"

# ---- points ----
code 0 $delaunay --help
code 2 $delaunay
code 3 $delaunay "$T/missing.xyz"
code 5 $delaunay "$T/flat.xyz" -o "$T/flat.mesh"
says 'flat.xyz'
code 5 $delaunay "$T/line.xyz" -o "$T/flat.mesh"
code 5 $delaunay "$T/same.xyz" -o "$T/flat.mesh"
: > "$T/none.xyz"
code 5 $delaunay "$T/none.xyz" -o "$T/flat.mesh"
absent "$T/flat.mesh"
code 0 $delaunay "$T/double.xyz" -o "$T/double.mesh"
ok "duplicates stay as vertices" test "$(sed -n 4p "$T/double.mesh")" = 6
code 0 $delaunay "$T/grid.xyz" --validate -o "$T/g1.mesh" --threads 1
code 0 $delaunay "$T/grid.xyz" --hull "$T/hull.mesh"
ok "the hull of a grid has six polygons" grep -q ' 6 polygons' "$T/out"
ok "the hull is written" grep -q Triangles "$T/hull.mesh"
sed 's/.*/0.25/' "$T/grid.xyz" > "$T/weights.txt"
code 0 $delaunay "$T/grid.xyz" --weights "$T/weights.txt" --validate -o "$T/g4.mesh"
ok "equal weights change nothing" cmp "$T/g1.mesh" "$T/g4.mesh"
code 3 $delaunay "$T/flat.xyz" --weights "$T/weights.txt"
code 3 $delaunay "$T/flat.xyz" --weights "$T/none.txt"
n=$(wc -l < "$T/grid.xyz")
{ head -n $((n - 1)) "$T/weights.txt"; echo 0,25; } > "$T/comma.txt"
code 3 $delaunay "$T/grid.xyz" --weights "$T/comma.txt"
code 0 $delaunay "$T/grid.xyz" -q -o "$T/g3.mesh" --threads 3
ok "same bytes for any number of threads" cmp "$T/g1.mesh" "$T/g3.mesh"

# ---- sizes, order, a mesh that is there already ----
code 0 $mesh "$T/cube.off" --size 0.3 -q -o "$T/s1.mesh"
code 0 $mesh "$T/cube.off" --size 0.3 --ball 0.5,0.5,0.5,0.1,0.05 -q -o "$T/s2.mesh"
count() { sed -n '/^Tetrahedra/{n;p;}' "$1"; }
ok "a ball of small sizes makes more tetrahedra" test "$(count "$T/s2.mesh")" -gt "$(count "$T/s1.mesh")"
code 0 $mesh "$T/cube.off" --size 0.15 -q -o "$T/fine.mesh"
ok "the least size is a size's bound" test "$(count "$T/fine.mesh")" -gt "$((3 * $(count "$T/s1.mesh")))"
same() { # FILE OPTIONS: the cube with these options is the same mesh
    file=$1
    shift
    code 0 $mesh "$T/cube.off" "$@" -q -o "$T/other.mesh"
    ok "$*" cmp "$file" "$T/other.mesh"
}
same "$T/fine.mesh" --max-size 0.15
same "$T/fine.mesh" --size 0.3 --size-factor 0.5
same "$T/s1.mesh" --size 0.15 --min-size 0.3
code 0 $mesh "$T/cube.off" --region-size 1=0.15 --region-size 3=0.1 -o "$T/region.mesh"
says 'there is no region 3 for --region-size'
ok "only one region is not there" test "$(wc -l < "$T/err")" = 1
ok "a size in a region" test "$(count "$T/region.mesh")" -gt "$((3 * $(count "$T/s1.mesh")))"
same "$T/region.mesh" --box 1,0,1,0,1,0,0.15
same "$T/s2.mesh" --size 0.3 --segment 0.5,0.5,0.5,0.5,0.5,0.5,0.1,0.05
code 0 $mesh "$T/cube.off" --size 0.3 --segment 0.5,0.5,0,0.5,0.5,1,0.1,0.05 -q -o "$T/other.mesh"
ok "a segment is more than a ball" test "$(count "$T/other.mesh")" -gt "$((2 * $(count "$T/s2.mesh")))"
echo '2 2 2  0 0 0  1 1 1  .15 .15 .15 .15 0.15 0.15 15e-2 0.15' > "$T/even.txt"
code 0 $mesh "$T/cube.off" --size-grid "$T/even.txt" -q -o "$T/other.mesh"
ok "sizes of a grid" test "$(count "$T/other.mesh")" -gt "$((3 * $(count "$T/s1.mesh")))"
echo '2 2 2  0 0 0  1 1 1  0 0 -1 nan 0 0 0 0' > "$T/nothing.txt"
code 0 $mesh "$T/cube.off" -q -o "$T/plain.mesh"
same "$T/plain.mesh" --size-grid "$T/nothing.txt"
code 0 $mesh --demo --no-improve -q -o "$T/straight.mesh"
code 0 $mesh --demo --no-improve --curvature 10 -q -o "$T/curved.mesh"
ok "holes are curved" test "$(count "$T/curved.mesh")" -gt "$((2 * $(count "$T/straight.mesh")))"
code 2 $mesh "$T/cube.off" --curvature 181
code 2 $mesh "$T/cube.off" --ball 0.5,0.5,0.5
code 2 $mesh "$T/cube.off" --region-size 0=1
code 3 $mesh "$T/cube.off" --size-grid "$T/missing.txt"
printf '2 2 2 nan 0 0 1 1 1 1 1 1 1 1 1 1 1' > "$T/nan.txt"
code 3 $mesh "$T/cube.off" --size-grid "$T/nan.txt"
says '2 or more each'
echo '2 2 2  0 0 0  1 1 1  1 1 1 1 1 1 1 1 9' > "$T/long.txt"
code 3 $mesh "$T/cube.off" --size-grid "$T/long.txt"
says 'and nothing else'
code 0 $mesh "$T/cube.off" --size 0.3 -q -o "$T/old.mesh"
code 3 $mesh "$T/cube.off" --size-mesh "$T/old.mesh"
says 'there is no .sol or .mtr file beside it'
nodes=$(awk '/^Vertices/ { getline; print $1; exit }' "$T/old.mesh")
{ echo "$nodes 1"; yes 0.15 | head -n "$nodes"; } > "$T/old.mtr"
code 0 $mesh "$T/cube.off" --size-mesh "$T/old.mesh" -q -o "$T/new.mesh"
ok "sizes at the nodes of a mesh" test "$(count "$T/new.mesh")" -gt "$((4 * $(count "$T/old.mesh")))"
{ echo 'MeshVersionFormatted 2 Dimension 3 SolAtVertices' "$nodes" '1 1'; yes 0 | head -n "$nodes"
} > "$T/old.sol" # asks for nothing, and is read instead
code 0 $mesh "$T/cube.off" --size-mesh "$T/old.mesh" -q -o "$T/new.mesh"
code 0 $mesh "$T/cube.off" -q -o "$T/old2.mesh"
ok "sizes that ask for nothing" cmp "$T/new.mesh" "$T/old2.mesh"
code 0 $mesh "$T/cube.off" --size 0.3 -q -o "$T/old2.mesh" --save-sizes "$T/old2.sol"
ok "sizes are saved beside the same mesh" cmp "$T/old.mesh" "$T/old2.mesh"
ok "a size for each vertex" test "$(awk '/^[0-9]/ && NF == 1 && n++ > 0 { s++ } END { print s }' "$T/old2.sol")" = "$nodes"
code 0 $mesh "$T/cube.off" --size-mesh "$T/old2.mesh" -q -o "$T/new.mesh"
ok "by sizes that were saved the mesh becomes like the one before" \
    test "$(count "$T/new.mesh")" -gt "$(($(count "$T/old.mesh") / 2))" -a \
    "$(count "$T/new.mesh")" -lt "$((2 * $(count "$T/old.mesh")))"
code 0 $mesh "$T/cube.off" --no-refine -q --save-sizes "$T/old2.mtr"
ok "sizes are saved without a mesh" test "$(wc -l < "$T/old2.mtr")" = 9
code 2 $mesh "$T/cube.off" --size-mesh "$T/old2.mesh" --save-sizes "$T/old2.sol"
says 'written over'
code 2 $mesh "$T/cube.off" --save-sizes "$T/old2.txt"
code 4 $mesh "$T/cube.off" --save-sizes "$T/missing/old.sol"
echo 2 > "$T/old.sol"
code 3 $mesh "$T/cube.off" --size-mesh "$T/old.mesh"
says "old.sol: line 1: expected 'meshversionformatted'"
code 3 $mesh "$T/cube.off" --size-mesh "$T/cube.off"
says 'there are no tetrahedra in it'
code 1 $mesh "$T/cube.off" --size 0.05 --max-vertices 300 --no-improve -q -o "$T/s2.mesh"
ok "exactly as many vertices as the budget allows" test "$(awk '/^Vertices/ { getline; print $1 }' "$T/s2.mesh")" = 300
code 0 $mesh "$T/s1.mesh" --refine-mesh --ball 0.5,0.5,0.5,0.1,0.05 -q -o "$T/s3.mesh"
ok "a mesh is refined" test "$(count "$T/s3.mesh")" -gt "$(count "$T/s1.mesh")"
code 5 $mesh "$T/cube.off" --refine-mesh
printf 'MeshVersionFormatted 2 Dimension 3\nVertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\nTetrahedra 2\n1 2 3 4 0\n1 2 3 4 0\nEnd\n' > "$T/twice.mesh"
code 5 $mesh "$T/twice.mesh" --refine-mesh
says 'same side of a facet'

# ---- a surface divided first ----
code 0 $mesh "$T/cube.off" --size 0.1
prints '12 triangles have edges more than three times as long'
prints 'refine-surface divides them'
code 0 $mesh "$T/cube.off" --layers 4 --effort 0.01
prints 'refine-surface divides them'
code 0 $mesh "$T/cube.off" --ball 0,0,0,0.1,0.05 --effort 0.01
prints '6 triangles have edges more than three times as long'
code 0 $mesh "$T/cube.off"
ok 'nothing to divide' sh -c "! grep -q refine-surface '$T/out'"
code 0 $mesh "$T/cube.off" --size 0.1 --refine-surface -o "$T/f1.mesh" --json "$T/f.json" --threads 1
prints 'triangles, divided'
prints '; 0 below 0.35'
ok 'the surface is finer' grep -q '"surface_triangles": 1[0-9][0-9][0-9],' "$T/f.json"
code 0 $mesh "$T/cube.off" --size 0.1 --refine-surface -o "$T/f2.mesh" --threads 2 -q
ok 'same bytes' cmp "$T/f1.mesh" "$T/f2.mesh"
code 0 $mesh "$T/f1.mesh" # its triangles bound it
code 0 $mesh "$T/twice.off" --ball 0,0,0,0.1,0.1 --refine-surface
code 1 $mesh "$T/cube.off" --size 0.1 --refine-surface --max-vertices 100 -o "$T/f2.mesh"
code 1 $mesh "$T/cube.off" --size 0.01 --refine-surface --max-tets 1000 --json "$T/f.json"
ok 'max-tets counts for triangles' sh -c "test \$(sed -n 's/.*\"surface_triangles\": \([0-9]*\),.*/\1/p' '$T/f.json') -le 500"
says 'a budget ended the division'
code 0 $mesh "$T/cube.off" --refine-surface
{
    printf 'OFF\n12 14 0\n0 0 0\n0 1 0\n1 1 0\n1 0 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n'
    printf '.2 .2 .5\n.8 .2 .5\n.2 .8 .5\n.8 .8 .5\n3 0 1 2\n3 0 2 3\n3 4 5 6\n3 4 6 7\n3 0 3 5\n3 0 5 4\n'
    printf '3 1 7 6\n3 1 6 2\n3 0 4 7\n3 0 7 1\n3 3 2 6\n3 3 6 5\n3 8 9 11\n3 8 11 10\n'
} > "$T/inner.off"
code 0 $mesh "$T/inner.off" --size 0.2 --refine-surface -v
prints '4 x open edge'
prints 'edge 8-9 of triangle 12 is in no other'
{ # a line that ends where it begins, and one between two corners
    printf 'MeshVersionFormatted 2\nDimension 3\nVertices\n8\n'
    sed -n '3,10s/$/ 0/p' "$T/cube.off"
    printf 'Triangles\n12\n'
    awk 'NR > 10 { print $2 + 1, $3 + 1, $4 + 1, 1 }' "$T/cube.off"
    printf 'Edges\n2\n1 8 5\n4 4 3\nEnd\n'
} > "$T/lines.mesh"
for how in '--size 0.3' '--size 0.3 --refine-surface' --flip-surface; do
    code 0 $mesh "$T/lines.mesh" $how -v --json "$T/l.json"
    prints 'line 1 has vertex 3 twice'
    ok 'JSON calls it a line' grep -q '"triangles": \[\], "lines": \[1\], "vertices": \[3\]' "$T/l.json"
done
code 1 $mesh "$T/cube.off" --size 0.01 --refine-surface --max-seconds 0.03 --no-improve
ok 'the limit is told as it was given' sh -c "! grep 'max-seconds [0-9]' '$T/err' | grep -qv 'max-seconds 0.03\$'"
code 0 $mesh "$T/cube.off" --layers 4 --refine-surface
prints '; 0 below 0.35'
code 2 $mesh "$T/f1.mesh" --size 0.1 --refine-surface --refine-mesh
{ # a disk with 12 corners, of needles from corner 0
    printf 'OFF\n24 44 0\n'
    awk 'BEGIN { for (z = 0; z < 2; z++) for (i = 0; i < 12; i++) print cos(0.5236 * i), sin(0.5236 * i), z / 2
        for (i = 1; i < 11; i++) { print 3, 0, i + 1, i; print 3, 12, 12 + i, 13 + i }
        for (i = 0; i < 12; i++) { j = (i + 1) % 12; print 3, i, j, 12 + j; print 3, i, 12 + j, 12 + i } }'
} > "$T/disk.off"
code 0 $mesh "$T/disk.off"
prints '^note *[1-9][0-9]* diagonals could be flipped'
code 0 $mesh "$T/cube.off"
ok 'nothing to flip' sh -c "! grep -q flip-surface '$T/out'"
code 0 $mesh "$T/disk.off" --flip-surface -o "$T/f4.mesh" --threads 1
prints '^surface *24 vertices, 44 triangles, [1-9][0-9]* flips'
prints '^surface *[0-9.]* s'
ok 'it is done' sh -c "! grep -q diagonals '$T/out'"
code 0 $mesh "$T/disk.off" --flip-surface -o "$T/f5.mesh" --threads 2 -q
ok 'same bytes' cmp "$T/f4.mesh" "$T/f5.mesh"
code 2 $mesh "$T/f1.mesh" --flip-surface --refine-mesh
says '^mesh: --flip-surface and --refine-mesh'

# ---- a line through a facet ----
awk 'BEGIN { print "MeshVersionFormatted 2\nDimension 3\nVertices\n10\n0.3 0.4 -1 0\n0.3 0.5 0.5 0" }
     FNR > 2 && FNR < 11 { print $1, $2, $3, 0 }
     FNR == 11 { print "Edges\n1\n1 2 7\nTriangles\n12" }
     FNR > 10 { print $2 + 3, $3 + 3, $4 + 3, 1 }
     END { print "End" }' "$T/cube.off" > "$T/line.mesh"
code 5 $mesh "$T/line.mesh"
says 'triangle [0-9]* and line 0 intersect'
says 'no-lines leaves the lines'
code 0 $mesh "$T/line.mesh" --no-lines -o "$T/n.mesh"
ok 'no line is written' sh -c "! grep -q Edges '$T/n.mesh'"

# ---- corners that a rounding has parted ----
parted() { # STEP: the cube as STL, its triangles moved apart by more and more steps
    awk -v s="$1" 'NR == FNR { if (FNR > 2 && FNR < 11) split($0, a, " "); for (k = 1; k <= 3; k++) x[FNR - 3, k] = a[k]; next }
         FNR == 1 { print "solid cube" }
         FNR > 10 { print "facet normal 0 0 0\nouter loop"
                    for (k = 2; k <= 4; k++)
                        printf "vertex %.17g %.17g %.17g\n", x[$k, 1] + s * FNR, x[$k, 2], x[$k, 3] - s * FNR
                    print "endloop\nendfacet" }
         END { print "endsolid cube" }' "$T/cube.off" "$T/cube.off"
}
parted 1e-12 > "$T/parted.stl"
code 5 $mesh "$T/parted.stl"
prints 'nearly equal vertices: with --weld 1.1e-06 there is no defect$'
says '; with --weld 1.1e-06 there is none$'
parted 1e-6 > "$T/wide.stl"
code 5 $mesh "$T/wide.stl" -q --json "$T/w.json" # cracks of 1e-5 and more
says 'open.*; with --weld 1.7e-05 there is none$'
ok 'JSON has the cure' grep -q '"weld_that_cures": 1.7e-05,' "$T/w.json"
code 0 $mesh "$T/wide.stl" -q --weld 1.7e-05
# a second cube, smaller than the cracks, is closed by itself
{ parted 1e-6 | sed '$d'; awk 'NR > 2 && NR < 11 { split($0, a, " "); for (k = 1; k <= 3; k++) x[NR - 3, k] = 0.3 + 4e-6 * a[k] }
    NR > 10 { print "facet normal 0 0 0\nouter loop"
              for (k = 2; k <= 4; k++) printf "vertex %.17g %.17g %.17g\n", x[$k, 1], x[$k, 2], x[$k, 3]
              print "endloop\nendfacet" }' "$T/cube.off"; echo 'endsolid cube'; } > "$T/powder.stl"
code 5 $mesh "$T/powder.stl" --json "$T/w.json"
says 'with --weld 1.7e-05 there is none, and 12 triangles vanish$'
ok 'JSON has the loss' grep -q '"triangles_it_drops": 12,' "$T/w.json"
# two closed cubes, one on the other, that overlap by a rounding
{ echo OFF; echo '16 24 0'
  awk 'NR > 2 && NR < 11' "$T/cube.off"
  awk 'NR > 2 && NR < 11 { print $1, $2, $3 ? 2 : 1 - 1e-9 }' OFMT=%.17g CONVFMT=%.17g "$T/cube.off"
  awk 'NR > 10' "$T/cube.off"
  awk 'NR > 10 { print 3, $2 + 8, $3 + 8, $4 + 8 }' "$T/cube.off"; } > "$T/stacked.off"
code 5 $mesh "$T/stacked.off"
says 'with --weld 2e-09 there is none$'
code 0 $mesh "$T/stacked.off" --weld 2e-09 -q
sed 's/0.99999999[0-9]*/0.9995/' "$T/stacked.off" > "$T/pressed.off" # by much more
code 5 $mesh "$T/pressed.off"
says 'with --weld 0.0005 there is none$'
code 0 $mesh "$T/pressed.off" --weld 0.0005 -q
code 5 $mesh "$T/parted.stl" --weld 1e-14
prints 'nearly equal vertices: --weld 1.1e-06 makes them equal$'
code 5 $mesh "$T/open.off" --json "$T/w.json"
ok 'an open surface is not cured' grep -q '"weld_that_cures": 0,' "$T/w.json"
code 0 $mesh "$T/parted.stl" --weld 1.1e-06 --json "$T/w.json"
prints 'weld *28 vertices put onto others'
ok 'JSON counts them' grep -q '"welded_vertices": 28' "$T/w.json"
code 0 $mesh "$T/parted.stl" --weld 1.1e-06 --check
code 2 $mesh "$T/f1.mesh" --weld 1 --refine-mesh
code 2 $mesh "$T/cube.off" --weld -1
code 5 $mesh "$T/overlap.off" --size 0.1 --refine-surface -o "$T/f3.mesh"
says 'triangle [0-9]* and triangle [0-9]* '
ok 'defects of the input' test -s "$T/f3.defects.vtu"
absent "$T/f3.mesh"
sed '/^Triangles/,/^Tetrahedra/{/^Tetrahedra/!d;}' "$T/s1.mesh" > "$T/tets.mesh"
code 0 $mesh "$T/tets.mesh" --drop-unused -o "$T/s5.mesh"
prints " 12 triangles"
ok "the border of tetrahedra is turned the same way all over" sh -c "! grep -q orientation '$T/out'"
awk '/^Triangles/ { print; getline; print 3; n = 3; t = 1; next }
     /^Tetrahedra/ { t = 0 }
     t { if (n-- > 0) print $1, $2, $3, 77; next }
     1' "$T/s1.mesh" > "$T/some.mesh"
code 0 $mesh "$T/some.mesh" --drop-unused -o "$T/s6.mesh"
prints " 12 triangles"
ok "triangles that do not close keep their tags beside the rest of the border" \
    test "$(grep -c ' 77$' "$T/s6.mesh")" = 3
{ printf 'MeshVersionFormatted 2 Dimension 3\nVertices 8\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 1 0\n'
  printf '5 0 0 0\n6 0 0 0\n5 1 0 0\n'; } > "$T/pair.vertices"
{ cat "$T/pair.vertices"; printf 'Triangles 2\n2 3 4 7\n2 4 3 7\nTetrahedra 2\n1 2 3 4 1\n5 2 3 4 2\nEnd\n'
} > "$T/twice.mesh"
code 0 $mesh "$T/twice.mesh" --drop-unused -o "$T/s7.mesh"
prints 'tetrahedra  2 in 2 regions'
{ cat "$T/pair.vertices"; printf 'Triangles 4\n1 3 2 7\n1 2 4 7\n2 3 4 7\n1 4 3 7\nTetrahedra 2\n1 2 3 4 1\n'
  printf '6 7 8 5 2\nEnd\n'; } > "$T/part.mesh"
code 0 $mesh "$T/part.mesh" -o "$T/s8.mesh"
prints 'tetrahedra  2 in 2 regions'
{ cat "$T/pair.vertices"; printf 'Tetrahedra 1\n1 2 3 4 1\nPyramids 1\n1 2 3 4 5 2\nEnd\n'; } > "$T/mixed.mesh"
code 3 $mesh "$T/mixed.mesh" -o "$T/s9.mesh"
says '1 hexahedra, prisms, pyramids or the like beside the tetrahedra are not read'
absent "$T/s9.mesh"
code 3 $mesh "$T/mixed.mesh" --refine-mesh -o "$T/s9.mesh"
code 3 $improve "$T/mixed.mesh" -o "$T/s9.mesh"
absent "$T/s9.mesh"
{ cat "$T/pair.vertices"; printf 'Triangles 4\n1 3 2 7\n1 2 4 7\n2 3 4 7\n1 4 3 7\nPyramids 1\n1 2 3 4 5 2\nEnd\n'
} > "$T/closed.mesh"
code 0 $mesh "$T/closed.mesh" --drop-unused
prints '1 x hexahedron, prism, pyramid or the like, not read'
{ sed '/^Pyramids/,$d' "$T/closed.mesh"; printf 'Tetrahedra 1\n1 2 3 4 1\nPyramids 1\n1 2 3 4 5 2\nEnd\n'
} > "$T/both.mesh"
code 0 $mesh "$T/both.mesh" --drop-unused
prints '1 x hexahedron, prism, pyramid or the like, not read'
sed -e 's/^Triangles 4/Triangles 3/' -e '/^1 4 3 7$/d' "$T/both.mesh" > "$T/ajar.mesh"
code 3 $mesh "$T/ajar.mesh" -o "$T/s9.mesh"
says 'are not read, and no triangles bound them all'
absent "$T/s9.mesh"
code 2 $mesh "$T/cube.off" --order 2 -o "$T/s4.mesh"
code 0 $mesh "$T/cube.off" --size 0.3 --order 2 -q -o "$T/s4.inp"
ok "ten nodes in .inp, too" grep -q 'TYPE=C3D10' "$T/s4.inp"
code 0 $mesh "$T/cube.off" --size 0.3 --order 2 -q -o "$T/s4.msh"
code 0 $mesh "$T/s4.msh" --no-refine -o "$T/s10.mesh" --json "$T/s10.json"
prints 'node at no corner, not in the mesh: in the middle of an element'
ok "JSON counts them" grep -q '"nodes_left_out": [1-9]' "$T/s10.json"
code 0 $mesh "$T/s4.msh" --refine-surface --size 0.3 -o "$T/s11.mesh" --json "$T/s11.json"
ok "nodes in the middle of edges are not vertices of the next mesh" \
    awk -F '[:,]' '/"gamma_min"/ { exit !($2 > 0.1) }' "$T/s11.json"
ok "ten different nodes a tetrahedron, each in the middle of its edge" awk '
    /^\$Nodes/ { n = 1; next } /^\$EndNodes/ { n = 0 }
    n && NF == 4 { for (k = 1; k < 4; k++) x[$1, k] = $(k + 1) }
    $2 == 11 && NF == 15 {
        seen++; split("1 2 2 3 1 3 1 4 3 4 2 4", e, " ")
        for (i = 0; i < 6; i++) for (k = 1; k < 4; k++) {
            d = 2 * x[$(10 + i), k] - x[$(5 + e[2 * i + 1]), k] - x[$(5 + e[2 * i + 2]), k]
            if (d > 1e-9 || d < -1e-9) bad = 1
        } }
    END { exit bad || !seen }' "$T/s4.msh"

# ---- seeds ----
tetrahedron_poly() { # X Y Z: a tetrahedron with a region point there
    printf '4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n4 0\n1 0\n3 1 3 2\n1 0\n3 1 2 4\n'
    printf '1 0\n3 2 3 4\n1 0\n3 1 4 3\n0\n1\n1 %s %s %s 5 -1\n' "$1" "$2" "$3"
}
tetrahedron_poly .1 .2 .3 > "$T/seed.poly"
code 0 $mesh "$T/seed.poly" --regions seeds -o "$T/seed.mesh"
ok "there is no largest volume to speak of" sh -c "! grep -q 'largest volume' '$T/out'"
sed 's/ 5 -1$/ 5 .001/' "$T/seed.poly" > "$T/fine.poly"
code 0 $mesh "$T/fine.poly"
prints '1 x largest volume of a region, not used'
# two tetrahedra: attribute 0 is no number of a region, 1 is that of the other one
{
    printf '8 3 0 0\n'
    printf '1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 2 0 0\n6 3 0 0\n7 2 1 0\n8 2 0 1\n8 0\n'
    for k in 0 4; do
        for f in '1 3 2' '1 2 4' '2 3 4' '1 4 3'; do
            echo "$f" | awk -v k=$k '{ print "1 0\n3", $1 + k, $2 + k, $3 + k }'
        done
    done
    printf '0\n2\n1 .1 .2 .3 0 -1\n2 2.1 .2 .3 1 -1\n'
} > "$T/two.poly"
code 0 $mesh "$T/two.poly" -o "$T/two.mesh"
prints '2: volume 0.16'
prints '1 of the regions got numbers'
tetrahedron_poly 2 3 4 > "$T/seed.poly"
code 5 $mesh "$T/seed.poly" --regions seeds -o "$T/beside.mesh"
says 'none of the surface.s cells is kept'
prints 'seed 0 at (2, 3, 4) is in no bounded cell'
absent "$T/beside.mesh"

code 1 $mesh "$T/cube.off" --size 0.3 --no-improve --target 0.9 -q -o "$T/below.mesh"
says 'below the target'
ok "a target that is not met leaves a mesh" grep -q '^End$' "$T/below.mesh"
code 4 $mesh "$T/cube.off" -q -o "$T/unwritten.mesh" --json /no/such/folder/x.json
absent "$T/unwritten.mesh"

# regions of any number; the one without a number gets one
two_tets() { # TAG TAG
    printf 'MeshVersionFormatted 2 Dimension 3\nVertices 5\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 1 0\nTetrahedra 2\n'
    printf '1 2 3 4 %s\n2 5 3 4 %s\nEnd\n' "$1" "$2"
}
for tags in '-7 -2147483648' '0 1' '2147483647 0' '-1 1'; do
    two_tets $tags > "$T/tags.mesh"
    for how in --refine-mesh --no-refine; do
        code 0 $mesh "$T/tags.mesh" $how -q -o "$T/tags2.mesh"
        ok "$tags with $how are two regions" awk '/^[A-Z]/ { section = $1 }
            section == "Tetrahedra" && NF == 5 && !seen[$5]++ { n++ } END { exit n != 2 }' "$T/tags2.mesh"
    done
done
printf 'MeshVersionFormatted 2 Dimension 3\nVertices 4\n0 0 0 11\n1 0 0 -12\n0 1 0 0\n0 0 1 14\nTriangles 4\n1 3 2 1\n1 2 4 2\n2 3 4 3\n1 4 3 4\nEnd\n' > "$T/refs.mesh"
for how in --size\ 0.3 --refine-surface\ --size\ 0.3 --no-refine; do
    code 0 $mesh "$T/refs.mesh" $how -q -o "$T/refs2.mesh"
    ok "references of vertices stay, $how" sh -c "awk '/^Vertices/ { getline; v = 1; next } v && /^[0-9.-]/ { print \$4 } /^[A-U]/ { v = 0 }' '$T/refs2.mesh' | awk 'NR <= 4 { first = first \" \" \$1; next } \$1 { exit 1 } END { exit first != \" 11 -12 0 14\" }'"
done
two_tets -7 5 > "$T/tags.mesh"
code 0 $mesh "$T/tags.mesh" --refine-mesh -q -o "$T/tags2.mesh"
ok "a region keeps its number" grep -q '^[0-9 ]* -7$' "$T/tags2.mesh"
code 1 $mesh "$T/cube.off" --max-tets 1 -q -o "$T/tags2.mesh"
says 'more tetrahedra than'

# ---- improve ----
code 0 $improve --help
code 0 $improve --version
prints '^improve [0-9.]*$'
code 0 $delaunay --version
prints '^delaunay [0-9.]*$'
code 2 $delaunay "$T/grid.xyz" --threads 0
says 'threads needs a number from 1 to 4096'
code 2 $improve
says 'no mesh'
code 0 $mesh "$T/cube.off" --size 0.2 --no-improve -q -o "$T/rough.mesh"
for measure in gamma sicn dihedral; do
    code 0 $improve "$T/rough.mesh" --measure $measure -q -o "$T/i.mesh" --json "$T/i.json"
    ok "$measure is improved" awk -F '[:,]' -v name=$measure '
        /"measure"/ { named = index($2, name) }
        /"before"/ { before = $5 } /"after"/ { after = $5 } /"sicn_min"/ { sicn[n++] = $2 }
        END { exit !(named && after > 1.5 * before && (sicn[0] == before) == (name == "sicn") &&
                     (sicn[1] == after) == (name == "sicn")) }' "$T/i.json"
done
code 2 $improve "$T/rough.mesh" --measure volume
says "measure needs gamma, sicn or dihedral, not 'volume'"
vertices() { sed -n '/^Vertices/,/^Triangles/p' "$1"; }
vertices "$T/rough.mesh" > "$T/rough.vertices"
code 0 $improve "$T/rough.mesh" --keep-vertices --no-smoothing -q -o "$T/i.mesh"
vertices "$T/i.mesh" > "$T/i.vertices"
ok "vertices are kept where they are" cmp "$T/rough.vertices" "$T/i.vertices"
ok "the tetrahedra are not" sh -c "! cmp -s '$T/rough.mesh' '$T/i.mesh'"
code 0 $improve "$T/rough.mesh" --keep-vertices -q -o "$T/i.mesh" --threads 1
vertices "$T/i.mesh" > "$T/i.vertices"
ok "vertices are kept" test "$(wc -l < "$T/i.vertices")" = "$(wc -l < "$T/rough.vertices")"
ok "they move" sh -c "! cmp -s '$T/rough.vertices' '$T/i.vertices'"
code 0 $improve "$T/rough.mesh" --keep-vertices -q -o "$T/i3.mesh" --threads 3
ok "improved in the same way by any number of threads" cmp "$T/i.mesh" "$T/i3.mesh"
code 1 $improve "$T/straight.mesh" --max-seconds 0.001 -o "$T/i.mesh"
ok "a budget leaves a mesh" grep -q '^End$' "$T/i.mesh"
code 2 $improve "$T/cube.mesh" --target 7
code 2 $improve "$T/cube.mesh" --effort 0
code 2 $mesh "$T/cube.off" --effort 101
code 0 $mesh "$T/cube.off" --effort 0.1 -q -o "$T/little.mesh"
code 0 $improve "$T/little.mesh" --effort 2
code 3 $improve "$T/missing.mesh"
code 5 $improve "$T/cube.off"
code 1 $improve "$T/t1.mesh" --target 0.99 --histogram --bad "$T/bad.csv"
cp "$T/out" "$T/improve.txt"
ok "all that is left is listed" awk -F, 'NR == FNR { if (/^after/) { split($0, f, " "); n = f[7] } next }
    FNR > 1 { seen++; wrong += !($4 < 0.99 && $5 >= $4 * 0.999 && $6 != "") }
    END { exit !(seen == n && n > 0 && !wrong) }' "$T/improve.txt" "$T/bad.csv"
code 4 $improve "$T/t1.mesh" -q --bad /no/such/folder/bad.csv
ok "what is left has reasons" grep -q '^bad ones left: ' "$T/improve.txt"
ok "the worst have places" grep -q ' at (.*): ' "$T/improve.txt"
ok "six angles a tetrahedron" awk '/^measure/ { m = 1 } /^degrees/ { m = 2 }
    m == 1 && $2 == "-" { a += $4; b += $5 } m == 2 && $2 == "-" { c += $4; d += $5 }
    END { exit !(c == 6 * a && d == 6 * b && b > 0) }' "$T/improve.txt"
code 1 $improve "$T/t1.mesh" --target 0.99 -o "$T/best.mesh"
prints 'after'
ok "a goal that is not met leaves a mesh" grep -q '^End$' "$T/best.mesh"
ok "the regions stay, minus one too" sh -c "sed -n '/^Tetrahedra/,\$p' '$T/best.mesh' | awk 'NF == 5 && \$5 != 1 { exit 1 }'"
sed '/^Tetrahedra/,$ s/^\(.* .* .* .*\) 1$/\1 -1/' "$T/t1.mesh" > "$T/minus.mesh"
code 1 $improve "$T/minus.mesh" -q --target 0.99 -o "$T/minus2.mesh"
ok "a region may be -1" sh -c "sed '/^Tetrahedra/,\$ s/ -1\$/ 1/' '$T/minus2.mesh' | cmp -s - '$T/best.mesh'"
# a sheet and a line inside stay what they are: facets and edges of tetrahedra
{ cube 0 0 0 1 0; awk 'BEGIN {
    for (j = 0; j < 7; j++) for (i = 0; i < 7; i++) print "v", .2 + .1 * i, .2 + .1 * j, .5
    for (j = 0; j < 6; j++) for (i = 0; i < 6; i++) {
        a = 8 + 7 * j + i; print "f 3", a, a + 1, a + 8; print "f 3", a, a + 8, a + 7 } }'; } |
    awk '$1 == "v" { v[++nv] = $2 " " $3 " " $4 } $1 == "f" { f[++nf] = $3 + 1 " " $4 + 1 " " $5 + 1 }
         END { print "MeshVersionFormatted 2 Dimension 3 Vertices", nv + 2
               for (i = 1; i <= nv; i++) print v[i], 0
               print ".2 .2 .2 0\n.8 .7 .3 0\nEdges 1\n" nv + 1, nv + 2, 9 "\nTriangles", nf
               for (i = 1; i <= nf; i++) print f[i], 3; print "End" }' > "$T/sheet.mesh"
code 0 $mesh "$T/sheet.mesh" --no-refine -q -o "$T/sheet1.mesh"
code 0 $improve "$T/sheet1.mesh" -q -o "$T/sheet2.mesh"
ok "something was improved" sh -c "! cmp -s '$T/sheet1.mesh' '$T/sheet2.mesh'"
ok "triangles and lines are of tetrahedra" awk '
    function key(a, b, c, s) {
        if (a > b) { s = a; a = b; b = s }
        if (b > c) { s = b; b = c; c = s }
        if (a > b) { s = a; a = b; b = s }
        return a " " b " " c
    }
    /^[A-Z]/ { section = $1; next }
    section == "Triangles" && NF == 4 { wanted[key($1 + 0, $2 + 0, $3 + 0)] }
    section == "Edges" && NF == 3 { wanted[key(0, $1 + 0, $2 + 0)] }
    section == "Tetrahedra" && NF == 5 {
        for (i = 1; i <= 4; i++) for (j = 1; j < i; j++) {
            delete wanted[key(0, $i + 0, $j + 0)]; tets++
            for (k = 1; k < j; k++) delete wanted[key($i + 0, $j + 0, $k + 0)]
        }
    }
    END { for (k in wanted) exit 1; exit tets == 0 }' "$T/sheet2.mesh"
# TetGen's -g lists the facets of all tetrahedra: these are no wishes
awk '/^[A-Z]/ { section = $1 }
    section == "Tetrahedra" && NF == 5 { t[n++] = $1 " " $2 " " $3; t[n++] = $1 " " $2 " " $4
                                         t[n++] = $1 " " $3 " " $4; t[n++] = $2 " " $3 " " $4 }
    /^End$/ { print "Triangles", n; for (i = 0; i < n; i++) print t[i], 0 }
    section != "Triangles" { print }' "$T/t1.mesh" > "$T/facets.mesh"
code 1 $improve "$T/facets.mesh" --target 0.99 -o "$T/facets2.mesh"
says 'inner ones do not stay'
printf 'MeshVersionFormatted 2 Dimension 3\nVertices 4\n0 0 0 0\n1e150 0 0 0\n0 1e150 0 0\n0 0 1e150 0\nTetrahedra 1\n1 2 3 4 0\nEnd\n' > "$T/far.mesh"
code 0 $improve "$T/far.mesh" --json -
ok "JSON has no word for what is not a number" sh -c "grep -q '\"sicn_min\"' '$T/out' && ! grep -Eq ': -?(nan|inf)' '$T/out'"
# many triangles that are no facets do not make it a list of all: the inner one stays, and they do
{
    printf 'MeshVersionFormatted 2 Dimension 3\nVertices 10\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 1 0\n'
    printf '5 0 0 0\n6 0 0 0\n5 1 0 0\n5 0 1 0\n6 1 1 0\nTetrahedra 2\n1 2 3 4 0\n5 4 3 2 0\n'
    printf 'Triangles 11\n2 3 4 7\n6 7 8 0\n6 7 9 0\n6 7 10 0\n6 8 9 0\n6 8 10 0\n6 9 10 0\n7 8 9 0\n'
    printf '7 8 10 0\n7 9 10 0\n8 9 10 0\nEnd\n'
} > "$T/shell.mesh"
code 0 $improve "$T/shell.mesh" -q -o "$T/shell2.mesh"
says 'are no facets'
ok "all triangles stay" sh -c "awk '/^Triangles/ { getline; print }' '$T/shell2.mesh' | grep -qx 11"
for f in best facets2; do
    awk '/^[A-Z]/ { section = $1 } section == "Tetrahedra" && NF == 5' "$T/$f.mesh" > "$T/$f.tets"
done
ok "what is improved does not depend on them" cmp "$T/best.tets" "$T/facets2.tets"
ok "there is something" test -s "$T/best.tets"
code 2 $improve "$T/t1.mesh" -o "$T/x.stl"
says 'no tetrahedra can be written'
code 2 $delaunay "$T/t1.mesh" -o "$T/x.off"
says 'no tetrahedra can be written'
code 2 $delaunay "$T/t1.mesh" --hull "$T/x.foo"
code 4 $improve "$T/t1.mesh" -o /no/such/folder/x.mesh
code 4 $delaunay "$T/t1.mesh" -o /no/such/folder/x.mesh

# ---- a thin tube, which is bad all over without vertices inside ----
awk -v n=100 -v m=8 'BEGIN {
    print "OFF"; print n * m, 2 * n * m, 0
    for (i = 0; i < n; i++)
        for (j = 0; j < m; j++) {
            a = 6.283185307 * i / n; b = 6.283185307 * j / m; r = 3 + 0.15 * cos(b)
            printf "%.12g %.12g %.12g\n", r * cos(a), r * sin(a), 0.15 * sin(b)
        }
    for (i = 0; i < n; i++)
        for (j = 0; j < m; j++) {
            k = (i + 1) % n; l = (j + 1) % m
            print 3, i * m + j, k * m + j, i * m + l
            print 3, k * m + j, k * m + l, i * m + l
        }
}' > "$T/tube.off"
code 0 $mesh "$T/tube.off" -q -o "$T/tube.mesh" --json "$T/tube.json"
ok "no bad tetrahedron in a tube" grep -q '"low": 0,' "$T/tube.json"

# ---- more crossing pairs than are looked for ----
thicket() { # N: N triangles across each of N others
    awk -v n="$1" 'BEGIN {
        print "OFF"; print 6 * n, 2 * n, 0
        for (i = 0; i < n; i++) { print i, -9, 0; print i, n + 9, 0; print i, n / 2, 3 * n }
        for (i = 0; i < n; i++) { print -9, i, 0.1; print n + 9, i, 0.1; print n / 2, i + 0.5, 0.1 }
        for (i = 0; i < 2 * n; i++) print 3, 3 * i, 3 * i + 1, 3 * i + 2
    }'
}
thicket 30 > "$T/thicket.off"
code 5 $mesh "$T/thicket.off" --check --json "$T/thicket.json"
prints ' 900 x intersection'
ok "all are counted" grep -q '"intersection": 900,.*"all_counted": true' "$T/thicket.json"
thicket 3300 > "$T/thicket.off"
code 5 $mesh "$T/thicket.off" --check --json "$T/thicket.json"
prints 'at least 1[0-9]* x intersection'
says 'and at least 1[0-9]* defects more'
ok "not all are counted" grep -q '"all_counted": false' "$T/thicket.json"

echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
