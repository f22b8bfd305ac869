#!/bin/sh
# league.sh FOLDER: each surface of a folder with an INDEX.tsv is meshed by this project's mesher,
# by gmsh's HXT and by TetGen (if they are installed), with one thread each. Prints one CSV line for
# each mesh, with the measures of bench/quality.c. Rivals get only the OFF files, which they can
# read. Environment: CLASS restricts the surfaces to one class, FILES to some files; LIMIT is the
# time for one run in seconds (default 120); NATIVE=1 adds gmsh's own mesher.
BUILD=${BUILD:-build}
LIMIT=${LIMIT:-120}
CC=${CC:-cc}
folder=$1
if [ ! -f "$folder/INDEX.tsv" ]; then
    echo "no INDEX.tsv in '$folder'; use make league MODELS=FOLDER" >&2
    exit 2
fi
T=$BUILD/league.tmp
mkdir -p "$T"
trap 'rm -rf "$T"' EXIT
$CC -O2 bench/quality.c -o "$T/quality" -lm || exit 1
limit=
command -v timeout > /dev/null && limit="timeout $LIMIT"
now() { date +%s.%N; }
row() { # MESHER MODEL START MESH IMPROVEMENT-SECONDS
    end=$(now)
    if [ -s "$4" ]; then line=$("$T/quality" --no-header "$4" 2> /dev/null); else line=; fi
    awk -v m="$1" -v f="$2" -v s="$3" -v e="$end" -v q="${line:-,,,,,,,,,,}" -v i="$5" \
        'BEGIN { printf "%s,%s,%s,%.3f,%s\n", f, m, q, e - s, i }'
}
# Converts an OFF file to MSH 2.2, as one surface.
to_msh() {
    tr -s ' \t\r' ' ' < "$1" | awk '
        /^ *(#|$)/ || /^ *OFF *$/ { next }
        { sub(/^ /, ""); sub(/^OFF /, "") }
        !nv { nv = $1; nf = $2; print "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" nv; next }
        v < nv { print ++v, $1, $2, $3; if (v == nv) print "$EndNodes\n$Elements" ; next }
        f < nf { f++; for (i = 2; i < $1; i++) t[n++] = ($2 + 1) " " ($(i + 1) + 1) " " ($(i + 2) + 1) }
        END { print n; for (i = 0; i < n; i++) print i + 1, 2, 2, 1, 1, t[i]; print "$EndElements" }' > "$2"
}
echo "model,mesher,tets,gamma_min,gamma_p001,gamma_p01,gamma_mean,below35,below30,sicn_min,dihedral_min,dihedral_max,free35,seconds,seconds_improve"
awk -F '\t' 'NR == 1 { for (i = 1; i <= NF; i++) c[$i] = i; next }
             $c["expect"] == "ok" && $c["file"] ~ /\.(off|stl|mesh)$/ { print $c["file"] "\t" $c["class"] }' \
    "$folder/INDEX.tsv" > "$T/list"
tab=$(printf '\t')
while IFS=$tab read -r file class; do
    [ -n "$CLASS" ] && [ "$class" != "$CLASS" ] && continue
    if [ -n "$FILES" ]; then case " $FILES " in *" $file "*) ;; *) continue ;; esac; fi
    rm -f "$T"/a.* "$T"/g.*
    start=$(now)
    $limit "$BUILD/mesh" "$folder/$file" -q --threads 1 -o "$T/a.mesh" --json "$T/a.json" > /dev/null 2>&1 < /dev/null
    row ours "$file" "$start" "$T/a.mesh" "$(sed -n 's/.*"improve": \([0-9.e-]*\).*/\1/p' "$T/a.json" 2> /dev/null)"
    case $file in *.off) ;; *) continue ;; esac
    for algorithm in hxt ${NATIVE:+del3d}; do
        command -v gmsh > /dev/null || break
        rm -f "$T"/g.*
        to_msh "$folder/$file" "$T/g.msh"
        echo 'Merge "g.msh"; Surface Loop(1)={1}; Volume(1)={1}; Physical Volume(1)={1};' > "$T/g.geo"
        start=$(now)
        $limit gmsh -3 "$T/g.geo" -algo $algorithm -nt 1 -v 4 -setnumber Mesh.OptimizeThreshold 0.35 -format mesh -save_all \
            -o "$T/g.mesh" > "$T/g.log" 2>&1 < /dev/null
        row gmsh-$algorithm "$file" "$start" "$T/g.mesh" \
            "$(sed -n 's/.*tOptimize[^0-9]*\([0-9.]*\).*/\1/p' "$T/g.log")"
    done
    if command -v tetgen > /dev/null; then
        rm -f "$T"/a.*
        cp "$folder/$file" "$T/a.off"
        start=$(now)
        $limit tetgen -BNEFIgVVYp -q1.1/14 -O7 -o/130 "$T/a.off" > "$T/g.log" 2>&1 < /dev/null
        row tetgen "$file" "$start" "$T/a.mesh" \
            "$(sed -n 's/^Mesh optimization seconds: *\([0-9.]*\).*/\1/p; s/^Optimization seconds: *\([0-9.]*\).*/\1/p' "$T/g.log")"
    fi
done < "$T/list"
