#!/bin/sh
# league.sh FOLDER: one CSV line for each surface of a folder with an INDEX.tsv and each mesher that
# is installed: ours at 1 thread and at all, tetgen and gmsh if they are there. Columns: commit,
# mesher, model, seconds (whole process), tetrahedra. CLASS restricts to one class, LIMIT is seconds.
BUILD=${BUILD:-build}
LIMIT=${LIMIT:-120}
folder=$1
if [ ! -f "$folder/INDEX.tsv" ]; then
    echo "no INDEX.tsv in '$folder'; use make league MODELS=FOLDER" >&2
    exit 2
fi
T=$BUILD/league.tmp
mkdir -p "$T"
trap 'rm -rf "$T"' EXIT
commit=$(git rev-parse --short HEAD 2> /dev/null || echo unknown)
limit=
command -v timeout > /dev/null && limit="timeout $LIMIT"
now() { date +%s.%N; }
row() { # MESHER MODEL START TETS
    awk -v c="$commit" -v m="$1" -v f="$2" -v s="$3" -v e="$(now)" -v n="$4" \
        'BEGIN { printf "%s,%s,%s,%.3f,%s\n", c, m, f, e - s, n }'
}
echo "commit,mesher,model,seconds,tetrahedra"
awk -F '\t' 'NR == 1 { for (i = 1; i <= NF; i++) c[$i] = i; next }
             $c["expect"] == "ok" && $c["file"] ~ /\.(off|stl|mesh)$/ { print $c["file"] "\t" $c["class"] }' \
    "$folder/INDEX.tsv" > "$T/list"
tab=$(printf '\t')
while IFS=$tab read -r file class; do
    [ -n "$CLASS" ] && [ "$class" != "$CLASS" ] && continue
    for threads in 1 all; do
        option=
        [ $threads = 1 ] && option="--threads 1"
        start=$(now)
        $limit "$BUILD/mesh" "$folder/$file" -q $option --json "$T/a.json" > /dev/null 2>&1 < /dev/null
        row "mesh-$threads" "$file" "$start" "$(sed -n 's/.*"tets": \([0-9]*\).*/\1/p' "$T/a.json")"
    done
    if command -v tetgen > /dev/null; then
        case $file in *.off | *.stl)
            cp "$folder/$file" "$T/a.${file##*.}"
            start=$(now)
            $limit tetgen -pYq1.1/14O7o/130NEFIB "$T/a.${file##*.}" > "$T/log" 2>&1 < /dev/null
            row tetgen "$file" "$start" "$(sed -n 's/.*Mesh tetrahedra: *//p' "$T/log" | tail -n 1)" ;;
        esac
    fi
    if command -v gmsh > /dev/null; then
        case $file in *.stl | *.mesh)
            cp "$folder/$file" "$T/g.${file##*.}"
            printf 'Merge "g.%s"; Surface Loop(1)={Surface{:}}; Volume(1)={1};\n' "${file##*.}" > "$T/g.geo"
            start=$(now)
            $limit gmsh -3 "$T/g.geo" -algo hxt -format mesh -o "$T/g.out.mesh" > "$T/log" 2>&1 < /dev/null
            row gmsh-hxt "$file" "$start" "$(awk 'f { print $1; exit } /^ *Tetrahedra/ { f = 1 }' "$T/g.out.mesh" 2> /dev/null)" ;;
        esac
    fi
done < "$T/list"
