/* mesh.c - makes a tetrahedral mesh from a surface file, or says in a sentence why it cannot
 *
 *   cc -O3 -fopenmp examples/mesh.c -o mesh -lm
 *   mesh part.stl -o part.vtu
 *
 * The only program that uses all five headers. It reads a surface (meshio.h), meshes it (mesher.h),
 * improves the mesh (spr.h), proves it valid (delaunay.h; the surface here), and writes it.
 */
#if defined(__STRICT_ANSI__) && !defined(_XOPEN_SOURCE)
#  define _XOPEN_SOURCE 700 /* with -std=c99 too, files and clocks are those of POSIX */
#endif
#define MESHER_IMPLEMENTATION
#include "../mesher.h"
#define SPR_IMPLEMENTATION
#include "../spr.h"
#define MESHIO_IMPLEMENTATION
#include "meshio.h"
#include "demo_part.h"
#include "tool.h"
#ifdef __GLIBC__
#  include <malloc.h> /* malloc_trim, mallopt */
#endif

static const char help_usage[] =
    "usage: mesh INPUT [-o OUTPUT] [options]\n"
    "       mesh --demo [-o OUTPUT] [options]\n"
    "\n"
    "Fills a triangulated surface with good tetrahedra. Every vertex and triangle of the surface\n"
    "comes back unchanged; the vertices of the input come first in the output, in their order.\n"
    "\n"
    "  INPUT                .stl .off .obj .ply .mesh .meshb .msh .vtk .vtu .inp .poly .smesh.\n"
    "                       Of a file with tetrahedra whose triangles are missing or do not close,\n"
    "                       the surface is what bounds the tetrahedra and their regions. These keep\n"
    "                       their numbers, and voids stay empty\n"
    "  -o, --output FILE    .mesh .meshb .msh (2.2) .msh4 (4.1) .vtu .vtk .inp .ele (+ .node .face);\n"
    "                       without it nothing is written but the statistics\n"
    "  --format F           write FILE in the format that has extension F\n"
    "  --ascii, --binary    for formats that have both: write this one\n"
    "  --order 2            tetrahedra of ten nodes, the six in the middles of edges last; for .msh\n"
    "                       (2.2), .vtu, .inp\n"
    "  --demo [N]           mesh a part that the program makes itself; fineness N, 1 .. 12\n"
    "\n"
    "sizes, that is, wanted edge lengths (default: 1.3 times those of the surface, interpolated\n"
    "inwards; where several apply, the smallest counts)\n"
    "  --size H             about H inside, where the surface is not finer\n"
    "  --size-factor F      multiply all sizes by F, but not the bounds, --layers and --curvature;\n"
    "                       at the surface sizes are at most 2.6 times the length of its edges\n"
    "  --min-size H, --max-size H\n"
    "                       bounds of all sizes\n"
    "  --gradation R        largest ratio of the sizes at two ends of an edge; default 2, and 1.4\n"
    "                       around balls, boxes and segments\n"
    "  --growth R           sizes grow by this ratio (> 1 to 1.7) from edge to edge, away from the\n"
    "                       surface\n"
    "  --coarse             few, well-shaped tetrahedra: the same as --growth 1.3\n"
    "  --region-size N=H    H in region N (1 .. 65535); this and the next three may be repeated, the\n"
    "                       three 64 times in all\n"
    "  --ball X,Y,Z,R,H     H within R of the point X,Y,Z, growing from there by the gradation\n"
    "  --box X,Y,Z,X,Y,Z,H  H in the box with these opposite corners, growing in the same way\n"
    "  --segment X,Y,Z,X,Y,Z,R,H\n"
    "                       H within R of the segment, growing in the same way\n"
    "  --size-grid FILE     sizes at the nodes of a regular grid. FILE is text: the numbers of nodes\n"
    "                       NX NY NZ, the first node X Y Z, the spacings DX DY DZ, and NX*NY*NZ\n"
    "                       sizes, X fastest; NX, NY, NZ are 2 or more. A size that is no positive\n"
    "                       number asks for nothing. Outside, as at the grid's border\n"
    "  --size-mesh FILE     sizes at the nodes of FILE, a tetrahedral mesh; outside it, as on its\n"
    "                       border. They are read from the file of the same name that ends in .sol\n"
    "                       (Medit, Mmg: a scalar a node) or, if there is none, in .mtr (TetGen);\n"
    "                       what is no positive number asks for nothing\n"
    "  --layers N           about N tetrahedra or more between facets that face each other; with\n"
    "                       --growth 1.3 they become larger away from there\n"
    "  --curvature DEG      an edge beside a curved surface spans at most DEG degrees of it\n"
    "\n";
static const char help_options[] =
    "what is done\n"
    "  --check              look for defects of the surface, and stop; there is no OUTPUT\n"
    "  --no-refine          recover the surface and stop: points inside only where recovery needs\n"
    "                       them, no improvement (the program improve can do that later)\n"
    "  --no-improve         stop after refinement\n"
    "  --weld D             first of all, merge vertices that differ by no more than D in each\n"
    "                       coordinate\n"
    "  --split-edges        cut triangles at vertices that are exactly on their edges, and leave out\n"
    "                       triangles that are collinear: mends T-junctions\n"
    "  --no-lines           ignore the lines of the input: they need not be edges of the mesh\n"
    "  --refine-surface     first halve edges of the surface that are much longer than the sizes\n"
    "                       ask for, within their planes: makes good tetrahedra possible under\n"
    "                       large triangles\n"
    "  --flip-surface       first flip diagonals of the surface within its planes, as\n"
    "                       --refine-surface does too: on fewer needles fewer tetrahedra are bad\n"
    "  --refine-mesh        INPUT is a tetrahedral mesh to be kept; add points where the sizes ask\n"
    "                       for them (default: the lengths of its own edges)\n"
    "  --regions R          which cells become regions. all: every bounded one (default); parity:\n"
    "                       those that an odd number of facets separates from the outside;\n"
    "                       winding: those that the orientation of the facets encloses; seeds:\n"
    "                       those with a region point of a .poly file, or tetrahedra in INPUT (the\n"
    "                       default if it has any; of other files, all)\n"
    "  --drop-unused        leave out vertices that no triangle or line has, or that are equal to\n"
    "                       others (default: OUTPUT has all vertices of INPUT, so that their numbers\n"
    "                       stay, and the former are nodes of the mesh, where they are in it)\n"
    "  --drop-outside       leave out triangles that no tetrahedron has: those outside every cell,\n"
    "                       which otherwise make the surface invalid, and those between cells that\n"
    "                       are not kept\n"
    "  --allow-surface-steiner\n"
    "                       as a last resort, add points on the surface where it cannot be\n"
    "                       recovered; the mesh is then written without triangles and lines\n"
    "\n";
static const char help_goals[] =
    "goals and budgets (exit 1 if one is not met; the mesh is valid all the same. With --max-memory\n"
    "exit 7, and no mesh, if the surface alone needs more)\n"
    "  --target Q           gamma of the worst tetrahedron; default: improve what is below 0.35 as\n"
    "                       far as possible, then the worst few, without a goal\n"
    "  --effort E           0.01 to 100, default 1: how long to try to improve where tetrahedra\n"
    "                       below 0.35 are left; more mostly leaves fewer\n"
    "  --max-seconds S, --max-tets N, --max-vertices N\n"
    "  --max-memory MB      of the mesh and each stage's work, INPUT apart\n"
    "\n"
    "  --threads N          default: what OpenMP chooses; the result does not depend on it, except\n"
    "                       under --max-seconds and --max-memory\n"
    "  --save-sizes FILE    write the sizes that OUTPUT was made by, at its vertices: to .sol, by which\n"
    "                       Mmg can adapt OUTPUT further, or .mtr (TetGen); --size-mesh reads both\n"
    "  --json FILE          write the statistics and all findings in a form for programs; - is where\n"
    "                       the program prints, here and for OUTPUT with --format\n"
    "  -v, --verbose        say what is being done, and list all regions\n"
    "  -q, --quiet          print nothing but errors\n"
    "  --help, --version\n"
    "\n"
    "In messages, vertices and triangles count from 0, in the order of the file; a polygon counts\n"
    "as the triangles that it is cut into.\n"
    "\n"
    "exit codes: 0 ok, 1 valid mesh but a goal or budget not met, 2 usage, 3 cannot read, 4 cannot\n"
    "write, 5 the surface is invalid, 6 a facet could not be recovered, 7 memory, 8 interrupted,\n"
    "70 internal error. With 5 and 6 the triangles concerned are written to a file with OUTPUT's\n"
    "name (without -o INPUT's, in the current folder) that ends in .defects.vtu; with 6, a small\n"
    "surface that fails in the same way to one that ends in .reproducer.off.\n";

/* ---- settings ---- */

enum { MAX_SOURCES = 64, MAX_REGION_SIZES = 65535 };

typedef struct settings {
    const char *input, *output, *json, *format, *size_grid, *size_mesh, *save_sizes;
    mesher_source sources[MAX_SOURCES];
    double region_sizes[MAX_REGION_SIZES];
    mesher_options mesher;
    spr_options spr;
    double max_seconds, weld;
    int order, demo, check, split_edges, refine_mesh, refine_surface, flip_surface, no_improve,
        no_lines, regions_given, ascii, binary, verbose, quiet, progress;
} settings;

static int parse_regions(const char *name, mesher_regions *regions)
{
    if (!name) return 0;
    if (strcmp(name, "all") == 0) *regions = MESHER_REGIONS_ALL;
    else if (strcmp(name, "parity") == 0) *regions = MESHER_REGIONS_PARITY;
    else if (strcmp(name, "winding") == 0) *regions = MESHER_REGIONS_WINDING;
    else if (strcmp(name, "seeds") == 0) *regions = MESHER_REGIONS_SEEDS;
    else return 0;
    return 1;
}

/* Reads n numbers with commas between them. Returns 0 if the text is anything else. */
static int parse_list(const char *text, int n, double *v)
{
    char *end;
    int i;
    if (!text || strspn(text, "0123456789.eE+-,") != strlen(text)) return 0;
    for (i = 0; i < n; i++) {
        v[i] = strtod(text, &end);
        if (end == text || *end != (i + 1 < n ? ',' : 0) || !(v[i] >= -1e300 && v[i] <= 1e300))
            return 0;
        text = end + 1;
    }
    return 1;
}

/* Takes --ball, --box or --segment. This and the next functions take one option; they return 0 if
 * it is none of theirs or has no valid value. */
static int parse_source(const char *a, const char *text, settings *s)
{
    mesher_source *source = s->sources + s->mesher.num_sources;
    double v[8];
    int i, n;
    if (s->mesher.num_sources == MAX_SOURCES) return 0;
    if (strcmp(a, "--ball") == 0) {
        source->shape = MESHER_SHAPE_BALL;
        n = 5;
    } else if (strcmp(a, "--box") == 0) {
        source->shape = MESHER_SHAPE_BOX;
        n = 7;
    } else if (strcmp(a, "--segment") == 0) {
        source->shape = MESHER_SHAPE_SEGMENT;
        n = 8;
    } else return 0;
    if (!parse_list(text, n, v)) return 0;
    for (i = 0; i < (n == 5 ? 3 : 6); i++) source->xyz[i] = v[i];
    if (n != 7) source->radius = v[n - 2];
    source->size = v[n - 1];
    if (!(source->size > 0) || source->radius < 0) return 0;
    s->mesher.sources = s->sources;
    s->mesher.num_sources++;
    return 1;
}

/* Takes --region-size N=H. */
static int parse_region_size(const char *a, const char *text, settings *s)
{
    double h;
    char *end;
    long n;
    if (strcmp(a, "--region-size") != 0 || !text) return 0;
    n = strtol(text, &end, 10);
    if (end == text || *end != '=' || n < 1 || n > MAX_REGION_SIZES ||
        !tool_number(end + 1, 1e-300, 1e300, &h))
        return 0;
    s->region_sizes[n - 1] = h;
    s->mesher.region_sizes = s->region_sizes;
    if (s->mesher.num_region_sizes < (size_t)n) s->mesher.num_region_sizes = (size_t)n;
    return 1;
}

/* Takes an option without a value. */
static int parse_flag(const char *a, settings *s)
{
    if (strcmp(a, "--check") == 0) s->check = 1;
    else if (strcmp(a, "--no-refine") == 0) s->mesher.no_refine = s->no_improve = 1;
    else if (strcmp(a, "--no-improve") == 0) s->no_improve = 1;
    else if (strcmp(a, "--no-lines") == 0) s->no_lines = 1;
    else if (strcmp(a, "--drop-unused") == 0) s->mesher.drop_unused = 1;
    else if (strcmp(a, "--split-edges") == 0) s->split_edges = 1;
    else if (strcmp(a, "--drop-outside") == 0) s->mesher.drop_outside = 1;
    else if (strcmp(a, "--refine-mesh") == 0) s->refine_mesh = 1;
    else if (strcmp(a, "--refine-surface") == 0) s->refine_surface = 1;
    else if (strcmp(a, "--flip-surface") == 0) s->flip_surface = 1;
    else if (strcmp(a, "--coarse") == 0) s->mesher.growth = 1.3;
    else if (strcmp(a, "--allow-surface-steiner") == 0) s->mesher.allow_surface_steiner = 1;
    else if (strcmp(a, "--ascii") == 0) s->ascii = 1;
    else if (strcmp(a, "--binary") == 0) s->binary = 1;
    else if (strcmp(a, "-v") == 0 || strcmp(a, "--verbose") == 0) s->verbose = 1;
    else if (strcmp(a, "-q") == 0 || strcmp(a, "--quiet") == 0) s->quiet = 1;
    else return 0;
    return 1;
}

/* What the options with a value need. */
static const tool_need needs[] = {
    {"-o", "the name of a file", 0, 0},
    {"--output", "the name of a file", 0, 0},
    {"--format", "an ending, as vtu", 0, 0},
    {"--order", "1 or 2", 1, 2},
    {"--size", "a number above 0", 1e-300, 1e300},
    {"--size-factor", "a number from 1e-6 to 1e6", 1e-6, 1e6},
    {"--min-size", "a number above 0", 1e-300, 1e300},
    {"--max-size", "a number above 0", 1e-300, 1e300},
    {"--gradation", "a number from 1 to 100", 1, 100},
    {"--growth", "a number from 1.0001 to 100 (more than 1.7 is 1.7)", 1.0001, 100},
    {"--region-size", "N=H, a number from 1 to 65535 and a size above 0", 0, 0},
    {"--ball", "X,Y,Z,R,H, with a size H above 0", 0, 0},
    {"--box", "X,Y,Z,X,Y,Z,H, with a size H above 0", 0, 0},
    {"--segment", "X,Y,Z,X,Y,Z,R,H, with a size H above 0", 0, 0},
    {"--size-grid", "the name of a file", 0, 0},
    {"--size-mesh", "the name of a file", 0, 0},
    {"--save-sizes", "a name that ends in .sol or .mtr", 0, 0},
    {"--layers", "a number from 1 to 1000", 1, 1000},
    {"--curvature", "a number of degrees from 0.1 to 180", 0.1, 180},
    {"--weld", "a number from 1e-60 to 1e60", 1e-60, 1e60},
    {"--regions", "all, parity, winding or seeds", 0, 0},
    {"--target", "a number from 1e-9 to 1", 1e-9, 1},
    {"--effort", "a number from 0.01 to 100", 0.01, 100},
    {"--max-seconds", "a number from 1e-6 to 1e9", 1e-6, 1e9},
    {"--max-tets", "a number from 1 to 1e18", 1, 1e18},
    {"--max-vertices", "a number from 1 to 1e18", 1, 1e18},
    {"--max-memory", "a number of megabytes from 1 to 1e9", 1, 1e9},
    {"--threads", "a number from 1 to 4096", 1, 4096},
    {"--json", "the name of a file", 0, 0},
    {NULL, NULL, 0, 0}};

/* Takes an option with a number. */
static int parse_number(const char *a, const char *text, settings *s)
{
    double v;
    if (!tool_needed_number(needs, a, text, &v)) return 0;
    if (strcmp(a, "--size") == 0) s->mesher.size = v;
    else if (strcmp(a, "--min-size") == 0) s->mesher.min_size = v;
    else if (strcmp(a, "--max-size") == 0) s->mesher.max_size = v;
    else if (strcmp(a, "--gradation") == 0) s->mesher.gradation = v;
    else if (strcmp(a, "--size-factor") == 0) s->mesher.size_factor = v;
    else if (strcmp(a, "--order") == 0 && (v == 1 || v == 2)) s->order = (int)v;
    else if (strcmp(a, "--layers") == 0) s->mesher.layers = v;
    else if (strcmp(a, "--curvature") == 0) s->mesher.curvature_degrees = v;
    else if (strcmp(a, "--weld") == 0) s->weld = v;
    else if (strcmp(a, "--growth") == 0) s->mesher.growth = v;
    else if (strcmp(a, "--target") == 0) {
        s->spr.target = v;
        s->spr.require_target = 1;
    } else if (strcmp(a, "--effort") == 0) s->spr.effort = v;
    else if (strcmp(a, "--max-seconds") == 0) s->max_seconds = v;
    else if (strcmp(a, "--max-tets") == 0) s->mesher.max_tets = (uint64_t)v;
    else if (strcmp(a, "--max-vertices") == 0) s->mesher.max_vertices = (uint64_t)v;
    else if (strcmp(a, "--max-memory") == 0)
        s->mesher.host.memory_limit_bytes = (size_t)(v * 1e6);
    else if (strcmp(a, "--threads") == 0) s->mesher.host.num_threads = (int)v;
    else return 0;
    return 1;
}

/* Takes an option with a word. */
static int parse_word(const char *a, const char *text, settings *s)
{
    if (!text) return 0;
    if (strcmp(a, "-o") == 0 || strcmp(a, "--output") == 0) s->output = tool_output_name(text);
    else if (strcmp(a, "--json") == 0) s->json = tool_output_name(text);
    else if (strcmp(a, "--size-grid") == 0) s->size_grid = text;
    else if (strcmp(a, "--size-mesh") == 0) s->size_mesh = text;
    else if (strcmp(a, "--save-sizes") == 0 && tool_ends_in(text, ".sol", ".mtr"))
        s->save_sizes = text;
    else if (strcmp(a, "--format") == 0) s->format = text;
    else if (strcmp(a, "--regions") == 0 && parse_regions(text, &s->mesher.regions))
        s->regions_given = 1;
    else return 0;
    return 1;
}

static meshio_format output_format(const settings *s)
{
    char name[40];
    if (!s->format) return meshio_format_of(s->output);
    snprintf(name, sizeof name, ".%.30s", s->format[0] == '.' ? s->format + 1 : s->format);
    return meshio_format_of(name);
}

/* Does the input have its nodes in a file of their own? */
static int has_nodes_beside(const char *input)
{
    const meshio_format format = input ? meshio_format_of(input) : MESHIO_FORMAT_AUTO;
    return format == MESHIO_FORMAT_POLY || format == MESHIO_FORMAT_SMESH;
}

/* Whether the files that are written are not those that are read, nor the same. */
static int files_are_apart(const settings *s, int is_ele)
{
    const char *json = s->json, *sizes = s->save_sizes;
    return tool_spares("mesh", "--json", json, s->input) &&
           tool_clears_output("mesh", "--json", json, s->output, is_ele) &&
           tool_is_apart("mesh", "--json", json, s->size_grid) &&
           tool_spares("mesh", "--json", json, s->size_mesh) &&
           tool_is_apart("mesh", "--save-sizes", sizes, s->input) &&
           tool_is_apart("mesh", "--save-sizes", sizes, s->output) &&
           tool_is_apart("mesh", "--save-sizes", sizes, json) &&
           tool_is_apart("mesh", "--save-sizes", sizes, s->size_grid) &&
           tool_spares("mesh", "--save-sizes", sizes, s->size_mesh);
}

/* Is the surface to be replaced by another one of the same shape? */
static int changes_surface(const settings *s)
{
    return s->refine_surface || s->flip_surface;
}

/* Whether the settings go together; if not, says which ones do not. */
static int settings_fit(const settings *s)
{
    const meshio_format format = s->output ? output_format(s) : MESHIO_FORMAT_AUTO;
    const int is_ele = format == MESHIO_FORMAT_ELE;
    if (s->refine_mesh && (changes_surface(s) || s->weld > 0 || s->split_edges)) {
        fprintf(stderr, "mesh: %s and --refine-mesh; try --help\n",
                s->weld > 0         ? "--weld"
                : s->split_edges    ? "--split-edges"
                : s->refine_surface ? "--refine-surface"
                                    : "--flip-surface");
        return 0;
    }
    if (s->refine_mesh && (s->regions_given || s->mesher.allow_surface_steiner)) {
        fprintf(stderr, "mesh: %s and --refine-mesh, which keeps the mesh and its regions\n",
                s->regions_given ? "--regions" : "--allow-surface-steiner");
        return 0;
    }
    if (!s->input == !s->demo) {
        fprintf(stderr, "mesh: %s; try --help\n",
                s->demo ? "a file, or a fineness beyond 1 to 12, and --demo"
                        : "no surface to mesh");
        return 0;
    }
    if (!files_are_apart(s, is_ele)) return 0;
    if (s->output && !meshio_holds_tetrahedra(format)) {
        fprintf(stderr, "mesh: no tetrahedra can be written %s'%s'; try .mesh, .msh or .vtu\n",
                s->format ? "in the format " : "to ", s->format ? s->format : s->output);
        return 0;
    }
    if (s->format && !s->output) {
        fprintf(stderr, "mesh: --format without --output; '-' is where the program prints\n");
        return 0;
    }
    if (s->ascii && s->binary) {
        fprintf(stderr, "mesh: --ascii and --binary; try --help\n");
        return 0;
    }
    if (s->output && s->order == 2 && format != MESHIO_FORMAT_MSH && format != MESHIO_FORMAT_VTU &&
        format != MESHIO_FORMAT_INP) {
        fprintf(stderr, "mesh: no second-order elements can be written to '%s'; try .msh or .vtu\n",
                s->output);
        return 0;
    }
    return !is_ele || !has_nodes_beside(s->input) ||
           tool_spares_nodes("mesh", "--output", s->output, s->input);
}

/* Returns 0: go on; 1: done (--help, --version); 2: wrong usage. */
static int parse(int argc, char **argv, settings *s)
{
    int i;
    double level;
    for (i = 1; i < argc; i++) {
        const char *a = argv[i], *next = argv[i + 1];
        if (strcmp(a, "--help") == 0 || strcmp(a, "-h") == 0) {
            fputs(help_usage, stdout);
            fputs(help_options, stdout);
            fputs(help_goals, stdout);
            return 1;
        }
        if (strcmp(a, "--version") == 0) {
            printf("mesh %d.%d.%d\n", MESHER_VERSION / 10000, MESHER_VERSION / 100 % 100,
                   MESHER_VERSION % 100);
            return 1;
        }
        if (strcmp(a, "--demo") == 0) {
            s->demo = 1;
            if (tool_number(next, 1, 12, &level)) {
                s->demo = (int)level;
                i++;
            }
        } else if (parse_number(a, next, s) || parse_word(a, next, s) || parse_source(a, next, s) ||
                   parse_region_size(a, next, s)) {
            i++;
        } else if (parse_flag(a, s)) {
            continue;
        } else if (a[0] != '-' && !s->input) {
            s->input = a;
        } else {
            if (s->mesher.num_sources == MAX_SOURCES)
                fprintf(stderr, "mesh: there may be no more than %d balls, boxes and segments\n",
                        MAX_SOURCES);
            tool_complain("mesh", needs, a, next);
            return 2;
        }
    }
    return settings_fit(s) ? 0 : 2;
}

/* ---- the state of a run ---- */

enum { PHASE_READ, PHASE_SURFACE, PHASE_CHECK, PHASE_EMPTY, PHASE_RECOVER, PHASE_REGIONS,
       PHASE_SIZE, PHASE_REFINE, PHASE_IMPROVE, PHASE_PROVE, PHASE_WRITE, NUM_PHASES };
static const char *const phase_names[NUM_PHASES] = {
    "read", "surface", "check", "empty mesh", "recover", "regions",
    "size", "refine",  "improve", "prove",    "write"};
enum { MAX_FINDINGS = 100000, SHOWN_FINDINGS = 10 };

/* What the search for a distance of --weld that leaves no defect has found. */
enum { CURE_UNKNOWN, CURE_NONE, CURE_FOUND }; /* unknown: it was not looked for to the end */
typedef struct weld_cure {
    int state;
    double distance;
    uint64_t num_gone; /* triangles that vanish with it */
} weld_cure;

/* For --order 2: elements of second order, and all nodes. */
typedef struct raised {
    double *xyz; /* NULL: there are none */
    size_t num_nodes;
    uint32_t *tets, *triangles, *edges;
} raised;

typedef struct job {
    settings set;
    const char *name; /* of the input, for messages */
    meshio_mesh in;
    int32_t *seed_tags;
    int has_tet_seeds;  /* the seeds are in the tetrahedra of the file, whose regions stay */
    size_t num_renamed; /* regions of the file whose attribute cannot be their number */
    double *seeds, *grid_sizes, *mesh_sizes;
    mesher_size_grid grid;
    meshio_mesh background; /* of --size-mesh */
    mesher_size_mesh size_mesh, kept_sizes; /* kept_sizes: for --save-sizes */
    double *kept_xyz;
    uint32_t *kept_tets;
    uint64_t num_welded;    /* vertices that --weld put onto others */
    uint64_t num_cut, num_collinear; /* triangles that --split-edges has cut, and left out */
    /* if it has changed the triangles, the numbers that those of in have in the file; or NULL */
    uint32_t *cut_from;
    size_t num_uncut; /* triangles of the file then */
    weld_cure cure;
    mesher_surface surface; /* the one to mesh: the input's, or fine.surface */
    mesher_fine_surface fine;
    mesher_domain domain;
    mesher_report report, notes; /* notes: of the surface of the file, if it is divided */
    spr_report spr;
    spr_statistics quality;
    mesher_output out;
    raised second;
    size_t num_dropped; /* vertices of the input that --drop-unused has left out */
    uint64_t num_large; /* triangles that --refine-surface had better divided */
    uint64_t num_flips; /* diagonals that --flip-surface would flip, if it would help */
    double seconds[NUM_PHASES], start;
    int code;          /* exit code so far */
    char message[768]; /* the last one of complain() */
} job;

/* Says what is wrong. Returns the exit code. */
static int complain(job *j, const char *text, int code)
{
    snprintf(j->message, sizeof j->message, "%s", text);
    fprintf(stderr, "mesh: %s: %s\n", j->name, text);
    return code;
}

static int on_progress(void *user, const char *phase, double fraction)
{
    const job *j = (const job *)user;
    if (j->set.progress && fraction < 0)
        fprintf(stderr, "\r%-30.30s", phase); /* the fraction is not known */
    else if (j->set.progress) fprintf(stderr, "\r%-24.24s %3.0f %%", phase, 100 * fraction);
    return tool_interrupted;
}

static void on_log(void *user, int level, const char *text)
{
    const job *j = (const job *)user;
    const int most = j->set.quiet ? DELAUNAY_LOG_ERROR : DELAUNAY_LOG_WARNING;
    if (level <= most || j->set.verbose) fprintf(stderr, "mesh: %s\n", text);
}

static void clear_progress(const job *j)
{
    if (j->set.progress) fprintf(stderr, "\r%-32s\r", "");
}

/* ---- reading ---- */

/* A facet of a tetrahedron, or a triangle of the file. */
typedef struct tet_side {
    uint32_t v[3];   /* its corners, ascending */
    int32_t tag;     /* of a facet: the tetrahedron's region */
    uint8_t odd;     /* sorting the corners has reversed the orientation */
    uint8_t of_file; /* a triangle of the file */
} tet_side;

static void set_side(tet_side *s, uint32_t a, uint32_t b, uint32_t c, int32_t tag)
{
    s->v[0] = a;
    s->v[1] = b;
    s->v[2] = c;
    s->odd = (uint8_t)tool_ascend(s->v);
    s->tag = tag;
    s->of_file = 0;
}

static int compare_sides(const void *a, const void *b)
{
    const uint32_t *v = ((const tet_side *)a)->v, *w = ((const tet_side *)b)->v;
    int k = 0;
    while (k < 2 && v[k] == w[k]) k++;
    return v[k] < w[k] ? -1 : v[k] > w[k];
}

static int compare_edges(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? -1 : x > y;
}

/* Whether some edge is in only one triangle; -1: out of memory. */
static int has_open_edges(const meshio_mesh *m)
{
    size_t n = 3 * m->num_triangles, i, k;
    uint64_t *edges = (uint64_t *)malloc((n + 1) * sizeof *edges);
    int open = 0;
    if (!edges) return -1;
    for (i = 0; i < n; i++) {
        uint32_t a = m->triangles[i], b = m->triangles[i % 3 == 2 ? i - 2 : i + 1];
        edges[i] = a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
    }
    qsort(edges, n, sizeof *edges, compare_edges);
    for (i = 0; i < n; i = k) {
        for (k = i + 1; k < n && edges[k] == edges[i]; k++) {}
        open |= k == i + 1;
    }
    free(edges);
    return open;
}

static uint64_t hash_side(const tet_side *s)
{
    uint64_t h = ((uint64_t)s->v[0] << 32 | s->v[1]) * UINT64_C(0x9e3779b97f4a7c15);
    h = (h ^ h >> 29 ^ s->v[2]) * UINT64_C(0xbf58476d1ce4e5b9);
    h = (h ^ h >> 32) * UINT64_C(0x94d049bb133111eb);
    return h ^ h >> 31;
}

/* Whether some facet is in only one tetrahedron and is no triangle of the file; -1: out of memory.
 * Takes the exclusive or of the hashes of all facets that are no triangles of the file: a facet
 * inside occurs twice and cancels out. If nothing is missing, this is far less work than sorting
 * all facets. */
static int lacks_border(const meshio_mesh *m)
{
    size_t n = m->num_triangles, i;
    uint64_t rest = 0;
    tet_side *triangles = (tet_side *)malloc((n + 1) * sizeof *triangles), s;
    uint8_t *has_triangle = (uint8_t *)calloc(m->num_vertices + 1, 1);
    int f, k, result = -1;
    if (!triangles || !has_triangle) goto done;
    for (i = 0; i < n; i++) {
        const uint32_t *v = m->triangles + 3 * i;
        set_side(triangles + i, v[0], v[1], v[2], 0);
        for (k = 0; k < 3; k++) has_triangle[v[k]] = 1;
    }
    qsort(triangles, n, sizeof *triangles, compare_sides);
    for (i = 0; i < m->num_tets; i++)
        for (f = 0; f < 4; f++) {
            const uint32_t *v = m->tets + 4 * i;
            uint32_t a = v[(f + 1) & 3], b = v[(f + 2) & 3], c = v[(f + 3) & 3];
            set_side(&s, a, b, c, 0);
            if (!has_triangle[a] || !has_triangle[b] || !has_triangle[c] ||
                !bsearch(&s, triangles, n, sizeof s, compare_sides))
                rest ^= hash_side(&s);
        }
    result = rest != 0;
done:
    free(triangles);
    free(has_triangle);
    return result;
}

/* All facets of the tetrahedra and all triangles of the file, n in total, sorted so that equal ones
 * are together. NULL: out of memory. */
static tet_side *sort_sides(const meshio_mesh *m, size_t n)
{
    tet_side *all = (tet_side *)malloc(n * sizeof *all), *s = all;
    size_t i;
    int f;
    if (!all) return NULL;
    for (i = 0; i < m->num_triangles; i++, s++) {
        const uint32_t *v = m->triangles + 3 * i;
        set_side(s, v[0], v[1], v[2], 0);
        s->of_file = 1;
    }
    for (i = 0; i < m->num_tets; i++)
        for (f = 0; f < 4; f++, s++) {
            const uint8_t *o = delaunay_facet_order(f);
            const uint32_t *v = m->tets + 4 * i;
            set_side(s, v[o[0]], v[o[1]], v[o[2]], m->tet_tags[i]);
        }
    qsort(all, n, sizeof *all, compare_sides);
    return all;
}

/* Adds to the file's triangles the missing facets on the border of its tetrahedra and between their
 * regions. Region 0 gets a number that no other region has: 1 if there is no other. Returns the
 * exit code. */
static int add_border(job *j)
{
    meshio_mesh *m = &j->in;
    size_t n = m->num_triangles + 4 * m->num_tets, i, k;
    tet_side *all, *s;
    uint32_t *triangles, *v;
    int32_t *tags;
    int32_t spare = tool_unused_tag(m->tet_tags, m->num_tets);
    size_t num_untagged = 0;
    for (i = 0; i < m->num_tets; i++)
        if (m->tet_tags[i] == 0) {
            m->tet_tags[i] = spare;
            num_untagged++;
        }
    j->num_renamed = num_untagged > 0 && num_untagged < m->num_tets;
    all = sort_sides(m, n);
    triangles = all ? (uint32_t *)realloc(m->triangles, 3 * n * sizeof *triangles) : NULL;
    if (triangles) m->triangles = triangles;
    tags = triangles ? (int32_t *)realloc(m->triangle_tags, n * sizeof *tags) : NULL;
    if (tags) m->triangle_tags = tags;
    for (i = 0; tags && i < n; i = k) {
        int there = all[i].of_file;
        for (k = i + 1; k < n && compare_sides(all + i, all + k) == 0; k++) there |= all[k].of_file;
        if (there || (k == i + 2 && all[i].tag == all[i + 1].tag)) continue;
        s = all[i].tag < all[k - 1].tag ? all + i : all + k - 1;
        v = m->triangles + 3 * m->num_triangles;
        v[0] = s->v[0];
        v[1] = s->v[1 + s->odd];
        v[2] = s->v[2 - s->odd];
        m->triangle_tags[m->num_triangles++] = s->tag;
    }
    free(all);
    return tags ? TOOL_OK : complain(j, "out of memory", TOOL_NO_MEMORY);
}

/* Makes sure that triangles bound the tetrahedra of the file, by adding those that are missing. */
static int bound_tets(job *j)
{
    const meshio_mesh *m = &j->in;
    const int refines = j->set.refine_mesh;
    char text[200];
    int open = refines || m->num_triangles == 0 ? 1
               : m->num_solids                  ? has_open_edges(m)
                                                : lacks_border(m);
    if (open < 0) return complain(j, "out of memory", TOOL_NO_MEMORY);
    if (!open) return TOOL_OK;
    if (!m->num_solids) return add_border(j);
    snprintf(text, sizeof text,
             "%llu hexahedra, prisms, pyramids or the like beside the tetrahedra are not read, and "
             "%s",
             (unsigned long long)m->num_solids,
             refines ? "would be lost" : "no triangles bound them all");
    return complain(j, text, TOOL_CANNOT_READ);
}

static int exit_code_of(meshio_result result)
{
    return result == MESHIO_ERROR_OUT_OF_MEMORY ? TOOL_NO_MEMORY : TOOL_CANNOT_READ;
}

static int read_input(job *j)
{
    meshio_report io;
    meshio_result result;
    double start = tool_seconds();
    if (j->set.demo) {
        j->name = "demo";
        if (!demo_part_make(&j->in, j->set.demo))
            return complain(j, "out of memory", TOOL_NO_MEMORY);
    } else {
        j->name = j->set.input;
        result = meshio_read(j->set.input, MESHIO_FORMAT_AUTO, &j->in, &io);
        if (result != MESHIO_OK) return complain(j, io.message, exit_code_of(result));
    }
    j->seconds[PHASE_READ] = tool_seconds() - start;
    if (j->set.refine_mesh && j->in.num_tets == 0)
        return complain(j, "the file has no tetrahedra to refine", TOOL_BAD_SURFACE);
    if (j->in.num_triangles == 0 && j->in.num_tets == 0)
        return complain(j,
                        j->in.num_other ? "the file has no triangles, so it bounds no volume; "
                                          "elements of its kinds are not read"
                                        : "the file has no triangles, so it bounds no volume",
                        TOOL_BAD_SURFACE);
    return j->in.num_tets > 0 ? bound_tets(j) : TOOL_OK;
}

/* Welds the vertices, if --weld asks for it. */
static int weld(job *j)
{
    double start = tool_seconds();
    mesher_result result;
    if (!(j->set.weld > 0)) return TOOL_OK;
    result = mesher_weld(j->in.xyz, j->in.num_vertices, j->set.weld, &j->set.mesher.host,
                         &j->num_welded);
    j->seconds[PHASE_READ] += tool_seconds() - start;
    if (result == MESHER_OK) return TOOL_OK;
    return complain(j, mesher_result_string(result), TOOL_NO_MEMORY);
}

/* Reads the file of --size-grid, if there is one. */
static int read_grid(job *j)
{
    mesher_size_grid *g = &j->grid;
    char text[400], more;
    FILE *f;
    size_t n = 1, i;
    int k, good;
    if (!j->set.size_grid) return TOOL_OK;
    f = fopen(j->set.size_grid, "r");
    if (!f) {
        snprintf(text, sizeof text, "cannot open the size grid '%.200s': %s", j->set.size_grid,
                 strerror(errno));
        return complain(j, text, TOOL_CANNOT_READ);
    }
    for (k = 0, good = 1; k < 3 && good; k++) {
        unsigned long count;
        good = fscanf(f, "%lu", &count) == 1 && count >= 2 && count <= 100000 &&
               count <= 1000000000 / n;
        g->count[k] = good ? (uint32_t)count : 0;
        n *= good ? count : 1;
    }
    for (k = 0; k < 3 && good; k++)
        good = fscanf(f, "%lf", &g->origin[k]) == 1 && g->origin[k] - g->origin[k] == 0;
    for (k = 0; k < 3 && good; k++)
        good = fscanf(f, "%lf", &g->spacing[k]) == 1 && g->spacing[k] > 0;
    if (good) j->grid_sizes = (double *)malloc(n * sizeof(double));
    if (good && !j->grid_sizes) {
        fclose(f);
        return complain(j, "out of memory", TOOL_NO_MEMORY);
    }
    for (i = 0; i < n && good; i++) good = fscanf(f, "%lf", &j->grid_sizes[i]) == 1;
    good = good && fscanf(f, " %c", &more) != 1;
    fclose(f);
    if (!good) {
        snprintf(text, sizeof text,
                 "'%.200s' is no size grid: it must hold NX NY NZ (2 or more each), X Y Z, "
                 "DX DY DZ (greater than 0) and NX*NY*NZ sizes, and nothing else",
                 j->set.size_grid);
        return complain(j, text, TOOL_CANNOT_READ);
    }
    g->size = j->grid_sizes;
    j->set.mesher.size_grid = g;
    return TOOL_OK;
}

/* Complains of a file beside the input. */
static int complain_of(job *j, const char *file, const char *text, int code)
{
    char all[600];
    snprintf(all, sizeof all, "%.250s: %.320s", file, text);
    return complain(j, all, code);
}

/* Reads the sizes at the nodes of the mesh of --size-mesh. */
static int read_mesh_sizes(job *j)
{
    const char *file = j->set.size_mesh;
    const size_t n = j->background.num_vertices;
    char name[TOOL_MAX_NAME];
    meshio_report io;
    meshio_result result = MESHIO_ERROR_OPEN;
    j->mesh_sizes = (double *)malloc((n + 1) * sizeof(double));
    if (!j->mesh_sizes) return complain_of(j, file, "out of memory", TOOL_NO_MEMORY);
    if (tool_with_ending(file, ".sol", name))
        result = meshio_read_sizes(name, j->mesh_sizes, n, &io);
    if (result == MESHIO_ERROR_OPEN && tool_with_ending(file, ".mtr", name))
        result = meshio_read_sizes(name, j->mesh_sizes, n, &io);
    if (result == MESHIO_ERROR_OPEN)
        return complain_of(j, file, "there is no .sol or .mtr file beside it that can be opened",
                           TOOL_CANNOT_READ);
    return result == MESHIO_OK ? TOOL_OK : complain_of(j, name, io.message, exit_code_of(result));
}

/* Reads the mesh of --size-mesh and its sizes, if there is one. */
static int read_size_mesh(job *j)
{
    const char *file = j->set.size_mesh;
    mesher_size_mesh *s = &j->size_mesh;
    mesher_report report;
    meshio_report io;
    meshio_result read;
    int code;
    if (!file) return TOOL_OK;
    read = meshio_read(file, MESHIO_FORMAT_AUTO, &j->background, &io);
    if (read != MESHIO_OK) return complain_of(j, file, io.message, exit_code_of(read));
    if (j->background.num_tets == 0)
        return complain_of(j, file, "there are no tetrahedra in it", TOOL_CANNOT_READ);
    code = read_mesh_sizes(j);
    if (code != TOOL_OK) return code;
    s->xyz = j->background.xyz;
    s->num_vertices = j->background.num_vertices;
    s->tets = j->background.tets;
    s->num_tets = j->background.num_tets;
    s->size = j->mesh_sizes;
    memset(&report, 0, sizeof report);
    switch (mesher_size_mesh_init(s, &j->set.mesher.host, &report)) {
    case MESHER_OK: break;
    case MESHER_ERROR_OUT_OF_MEMORY: return complain_of(j, file, report.message, TOOL_NO_MEMORY);
    default: return complain_of(j, file, report.message, TOOL_CANNOT_READ);
    }
    j->set.mesher.size_mesh = s;
    return TOOL_OK;
}

/* Makes room for n seeds. Returns 0 if memory runs out. */
static int seeds_room(job *j, size_t n)
{
    if (n > (size_t)-1 / 24) return 0;
    j->seeds = (double *)malloc(3 * n * sizeof(double));
    j->seed_tags = (int32_t *)malloc(n * sizeof(int32_t));
    return j->seeds && j->seed_tags;
}

/* Hands n seeds to the mesher, which keeps the cells that have one unless --regions says otherwise.
 */
static void use_seeds(job *j, size_t n)
{
    j->surface.seeds = j->seeds;
    j->surface.seed_tags = j->seed_tags;
    j->surface.num_seeds = n;
    if (!j->set.regions_given) j->set.mesher.regions = MESHER_REGIONS_SEEDS;
}

/* Whether an attribute can be the number of a region; if not, the region gets the next number that
 * no other has. */
static int is_region_number(double attribute)
{
    return attribute >= 1 && attribute < 2e9 && attribute == floor(attribute);
}

/* Turns the holes and regions of a .poly file into seeds. Returns 0 if memory runs out. */
static int take_seeds(job *j)
{
    size_t n = j->in.num_holes + j->in.num_regions, i;
    int32_t spare = 0;
    if (n == 0) return 1;
    if (!seeds_room(j, n)) return 0;
    for (i = 0; i < n; i++) {
        const double *xyz = i < j->in.num_holes ? j->in.holes + 3 * i
                                                : j->in.regions + 5 * (i - j->in.num_holes);
        memcpy(j->seeds + 3 * i, xyz, 3 * sizeof(double));
        j->seed_tags[i] = 0;
        if (i >= j->in.num_holes && is_region_number(xyz[3])) j->seed_tags[i] = (int32_t)xyz[3];
        if (j->seed_tags[i] > spare) spare = j->seed_tags[i];
    }
    for (i = j->in.num_holes; i < n; i++)
        if (j->seed_tags[i] == 0) {
            j->seed_tags[i] = ++spare;
            j->num_renamed++;
        }
    use_seeds(j, n);
    return 1;
}

/* Side i of a mesh: a triangle of the file, or after all of them a facet of a tetrahedron. */
static void set_side_of(tet_side *s, const meshio_mesh *m, size_t i)
{
    const uint32_t *v = m->triangles + 3 * i;
    const size_t f = i - m->num_triangles;
    const uint8_t *o = delaunay_facet_order((int)(f % 4));
    if (i < m->num_triangles) {
        set_side(s, v[0], v[1], v[2], 0);
        return;
    }
    v = m->tets + f / 4 * 4;
    set_side(s, v[o[0]], v[o[1]], v[o[2]], m->tet_tags[f / 4]);
}

static size_t root_of(size_t *parent, size_t t)
{
    while (parent[t] != t) t = parent[t] = parent[parent[t]];
    return t;
}

/* Joins the neighbouring tetrahedra of a region that no triangle of the file is between: those of a
 * cell get the same root in parent. Returns 0 if memory runs out. */
static int join_tets(const meshio_mesh *m, size_t *parent)
{
    const size_t n = m->num_triangles + 4 * m->num_tets;
    size_t size = 1024, i, k, *table; /* table: by hash, sides + 1, one of each pair */
    tet_side s, other;
    while (size < n + n / 2) size *= 2;
    table = (size_t *)calloc(size, sizeof *table);
    if (!table) return 0;
    for (i = 0; i < m->num_tets; i++) parent[i] = i;
    for (i = 0; i < n; i++) {
        set_side_of(&s, m, i);
        for (k = (size_t)hash_side(&s) & (size - 1); table[k]; k = (k + 1) & (size - 1)) {
            set_side_of(&other, m, table[k] - 1);
            if (compare_sides(&s, &other) == 0) break;
        }
        if (!table[k]) {
            table[k] = i + 1;
        } else if (table[k] > m->num_triangles && s.tag == other.tag) {
            const size_t t = (i - m->num_triangles) / 4, u = (table[k] - 1 - m->num_triangles) / 4;
            parent[root_of(parent, t)] = root_of(parent, u);
        }
    }
    free(table);
    return 1;
}

/* About the volume of a tetrahedron, and the middle between its corners. */
static double volume_of(const meshio_mesh *m, size_t t, double middle[3])
{
    const uint32_t *v = m->tets + 4 * t;
    const double *x[4];
    double e[3][3];
    int k, c;
    for (k = 0; k < 4; k++) x[k] = m->xyz + 3 * (size_t)v[k];
    for (c = 0; c < 3; c++) {
        middle[c] = 0.25 * x[0][c] + 0.25 * x[1][c] + 0.25 * x[2][c] + 0.25 * x[3][c];
        for (k = 0; k < 3; k++) e[k][c] = x[k + 1][c] - x[0][c];
    }
    return fabs(e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) +
                e[0][1] * (e[1][2] * e[2][0] - e[1][0] * e[2][2]) +
                e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]));
}

static int compare_tags(const void *a, const void *b)
{
    const int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return x < y ? -1 : x > y;
}

/* Gives the n seeds whose tags cannot be numbers of regions the next numbers that no other has, the
 * same to equal ones. Returns 0 if memory runs out. */
static int rename_seeds(job *j, size_t n)
{
    int32_t *bad = (int32_t *)malloc((n + 1) * sizeof *bad), spare = 0;
    size_t count = 0, distinct = 0, i;
    if (!bad) return 0;
    for (i = 0; i < n; i++)
        if (!is_region_number(j->seed_tags[i])) bad[count++] = j->seed_tags[i];
        else if (j->seed_tags[i] > spare) spare = j->seed_tags[i];
    qsort(bad, count, sizeof *bad, compare_tags);
    for (i = 0; i < count; i++)
        if (distinct == 0 || bad[distinct - 1] != bad[i]) bad[distinct++] = bad[i];
    for (i = 0; i < n; i++)
        if (!is_region_number(j->seed_tags[i])) {
            const int32_t *at = (const int32_t *)bsearch(&j->seed_tags[i], bad, distinct,
                                                         sizeof *bad, compare_tags);
            j->seed_tags[i] = spare + 1 + (int32_t)(at - bad);
        }
    j->num_renamed += distinct;
    free(bad);
    return 1;
}

/* Puts a seed into the largest tetrahedron of each cell of the file's tetrahedra, with its tag, so
 * that the regions keep their numbers, and voids stay empty. Returns 0 if memory runs out. */
static int take_tet_seeds(job *j)
{
    const meshio_mesh *m = &j->in;
    const size_t n = m->num_tets;
    size_t *parent = (size_t *)malloc((n + 1) * sizeof *parent), t, r, num = 0;
    size_t *largest = (size_t *)calloc(n + 1, sizeof *largest); /* of a root; plus 1 */
    double *volume = (double *)calloc(n + 1, sizeof *volume), middle[3], size;
    int ok = parent && largest && volume && join_tets(m, parent);
    for (t = 0; ok && t < n; t++) {
        r = root_of(parent, t);
        num += r == t;
        size = volume_of(m, t, middle);
        if (largest[r] && !(size > volume[r])) continue;
        largest[r] = t + 1;
        volume[r] = size;
    }
    ok = ok && seeds_room(j, num);
    for (num = 0, t = 0; ok && t < n; t++) {
        if (parent[t] != t) continue;
        (void)volume_of(m, largest[t] - 1, j->seeds + 3 * num);
        j->seed_tags[num++] = m->tet_tags[t];
    }
    ok = ok && rename_seeds(j, num);
    if (ok) use_seeds(j, num);
    j->has_tet_seeds = ok;
    free(parent);
    free(largest);
    free(volume);
    return ok;
}

static int set_surface(job *j)
{
    size_t i;
    int tagged = 0;
    for (i = 0; i < j->in.num_triangles && !tagged; i++) tagged = j->in.triangle_tags[i] != 0;
    for (i = 0; i < j->in.num_triangles && !tagged; i++) j->in.triangle_tags[i] = 1;
    j->surface.xyz = j->in.xyz;
    j->surface.num_vertices = j->in.num_vertices;
    j->surface.left_out = j->in.spare;
    j->surface.triangles = j->in.triangles;
    j->surface.triangle_tags = j->in.triangle_tags;
    j->surface.num_triangles = j->in.num_triangles;
    j->surface.edges = j->in.edges;
    j->surface.edge_tags = j->in.edge_tags;
    j->surface.num_edges = j->set.no_lines ? 0 : j->in.num_edges;
    j->report.findings = (mesher_finding *)malloc(MAX_FINDINGS * sizeof(mesher_finding));
    j->report.cap_findings = MAX_FINDINGS;
    if (!j->report.findings || !take_seeds(j)) return 0;
    if (j->in.num_tets == 0 || j->in.num_solids > 0 || j->surface.num_seeds > 0 ||
        j->set.refine_mesh)
        return 1;
    if (j->set.regions_given && j->set.mesher.regions != MESHER_REGIONS_SEEDS) return 1;
    return take_tet_seeds(j);
}

/* ---- findings ---- */

/* The name of OUTPUT, or without -o that of the input without its folder, with another ending.
 * Returns 0, and says so, if it is too long. */
static int side_name(const job *j, const char *ending, char name[TOOL_MAX_NAME])
{
    const char *output = j->set.output, *slash = strrchr(j->name, '/');
    if (output && strncmp(output, "/dev/", 5) == 0) output = NULL;
    if (tool_with_ending(output ? output : slash ? slash + 1 : j->name, ending, name)) return 1;
    fprintf(stderr, "mesh: the name of OUTPUT is too long for a %s file beside it\n", ending);
    return 0;
}

/* The number of triangles in the file. */
static size_t num_in_file(const job *j) { return j->cut_from ? j->num_uncut : j->in.num_triangles; }

/* A finding with the numbers that triangles and lines have in the file. */
static mesher_finding finding_in_file(const job *j, const mesher_finding *f)
{
    const size_t n = j->in.num_triangles;
    mesher_finding found = *f;
    int k;
    if (!j->cut_from || j->report.input_triangles != n) return found;
    for (k = 0; k < 2; k++) {
        uint32_t *id = &found.triangles[k];
        if (*id < n) *id = j->cut_from[*id];
        else if (*id != DELAUNAY_NO_ID) *id = (uint32_t)(*id - n + j->num_uncut);
    }
    return found;
}

/* The same as a sentence. */
static void describe(const job *j, const mesher_finding *f, char text[512])
{
    const mesher_finding found = finding_in_file(j, f);
    mesher_report report = j->report;
    if (j->cut_from && report.input_triangles == j->in.num_triangles)
        report.input_triangles = j->num_uncut;
    mesher_finding_string(text, 512, &report, &found);
}

/* The report's message, which begins with the first finding. */
static void describe_report(const job *j, char text[512])
{
    const mesher_report *r = &j->report;
    char sentence[512];
    size_t n = 0;
    text[0] = 0;
    if (r->num_findings) {
        mesher_finding_string(sentence, sizeof sentence, r, r->findings);
        if (strncmp(r->message, sentence, strlen(sentence)) == 0) {
            n = strlen(sentence);
            describe(j, r->findings, text);
        }
    }
    snprintf(text + strlen(text), 512 - strlen(text), "%s", r->message + n);
}

/* Writes a file with the triangles of all findings: one cell for each, with the kind of the finding
 * and the number of the triangle as fields. */
static void write_defects(const job *j)
{
    meshio_mesh m;
    meshio_report io;
    meshio_write_options options;
    meshio_field fields[2];
    char name[TOOL_MAX_NAME];
    size_t n = j->report.num_findings, i, k = 0;
    uint32_t *triangles = (uint32_t *)malloc((6 * n + 1) * sizeof(uint32_t));
    double *kinds = (double *)malloc((2 * n + 1) * sizeof(double));
    double *numbers = (double *)malloc((2 * n + 1) * sizeof(double));
    int side;
    memset(&m, 0, sizeof m);
    memset(&options, 0, sizeof options);
    memset(fields, 0, sizeof fields);
    for (i = 0; triangles && kinds && numbers && i < n; i++)
        for (side = 0; side < 2; side++) {
            const mesher_finding *f = &j->report.findings[i];
            const mesher_finding found = finding_in_file(j, f);
            uint32_t t = f->triangles[side];
            const uint32_t *v;
            if (t >= j->surface.num_triangles) continue;
            v = j->surface.triangles + 3 * (size_t)t;
            if (v[0] >= j->surface.num_vertices || v[1] >= j->surface.num_vertices ||
                v[2] >= j->surface.num_vertices)
                continue;
            memcpy(triangles + 3 * k, v, 3 * sizeof *v);
            kinds[k] = f->kind;
            numbers[k++] = found.triangles[side];
        }
    if (!triangles || !kinds || !numbers)
        fprintf(stderr, "mesh: no memory for the file with the findings\n");
    if (k > 0 && side_name(j, ".defects.vtu", name)) {
        m.xyz = (double *)j->surface.xyz; /* read only */
        m.num_vertices = j->surface.num_vertices;
        m.triangles = triangles;
        m.num_triangles = k;
        fields[0].name = "kind";
        fields[0].triangles = kinds;
        fields[1].name = "triangle";
        fields[1].triangles = numbers;
        options.fields = fields;
        options.num_fields = 2;
        options.format = MESHIO_FORMAT_VTU;
        if (meshio_write(name, &m, &options, &io) != MESHIO_OK)
            fprintf(stderr, "mesh: %s\n", io.message);
        else if (!j->set.quiet) printf("findings    %s\n", name);
    }
    free(triangles);
    free(kinds);
    free(numbers);
}

/* Writes a file with a small part of the surface that fails in the same way or, if there is none,
 * with the triangles nearest to the failure. */
static void write_reproducer(const job *j, mesher_result failure)
{
    double *xyz = (double *)malloc((3 * j->surface.num_vertices + 24) * sizeof *xyz);
    uint32_t *triangles =
        (uint32_t *)malloc((3 * j->surface.num_triangles + 36) * sizeof *triangles);
    mesher_surface part;
    mesher_result result = MESHER_ERROR_OUT_OF_MEMORY;
    meshio_mesh m;
    meshio_report io;
    meshio_write_options options;
    char name[TOOL_MAX_NAME];
    if (xyz && triangles && j->report.num_findings)
        result = mesher_reproduce(&j->surface, &j->set.mesher, failure, j->report.findings[0].xyz,
                                  xyz, triangles, &part);
    if (result == MESHER_ERROR_OUT_OF_MEMORY)
        fprintf(stderr, "mesh: no memory for a file that reproduces the failure\n");
    if (result >= 0 && side_name(j, ".reproducer.off", name)) {
        memset(&m, 0, sizeof m);
        memset(&options, 0, sizeof options);
        m.xyz = xyz;
        m.num_vertices = part.num_vertices;
        m.triangles = triangles;
        m.num_triangles = part.num_triangles;
        options.format = MESHIO_FORMAT_OFF;
        if (meshio_write(name, &m, &options, &io) != MESHIO_OK)
            fprintf(stderr, "mesh: %s\n", io.message);
        else if (!j->set.quiet)
            printf("reproducer  %s: %llu triangles near the failure%s\n", name,
                   (unsigned long long)part.num_triangles,
                   result == MESHER_OK ? ", and a box around them"
                                       : ", which are recovered by themselves");
    }
    free(xyz);
    free(triangles);
}

static void print_findings(const job *j, int defects)
{
    size_t i, count = 0;
    char text[512];
    for (i = 0; i < j->report.num_findings; i++) {
        const mesher_finding *f = &j->report.findings[i];
        if (mesher_is_defect(f->kind) != defects || count++ >= SHOWN_FINDINGS) continue;
        describe(j, f, text);
        printf("            %s\n", text);
    }
    if (count > SHOWN_FINDINGS)
        printf("            and others: --json FILE lists %s\n",
               j->report.num_findings < MAX_FINDINGS ? "all" : "the first 100000");
}

/* The smallest distance with which --weld joins all that MESHER_NOTE_NEAR_VERTEX calls nearly
 * equal. */
static double nearly(const job *j)
{
    double extent = 0;
    size_t corners = 3 * j->surface.num_triangles, i;
    int k;
    for (k = 0; k < 3; k++) {
        double lo = HUGE_VAL, hi = -HUGE_VAL;
        for (i = 0; i < corners + 2 * j->surface.num_edges; i++) {
            uint32_t v = i < corners ? j->surface.triangles[i] : j->surface.edges[i - corners];
            lo = fmin(lo, j->surface.xyz[3 * (size_t)v + (size_t)k]);
            hi = fmax(hi, j->surface.xyz[3 * (size_t)v + (size_t)k]);
        }
        extent = fmax(extent, hi - lo);
    }
    return MESHER_NEARLY * extent;
}

/* A number of two digits that is no smaller. */
static double rounded_up(double x)
{
    char text[32];
    double y;
    snprintf(text, sizeof text, "%.1e", x);
    y = strtod(text, NULL);
    return y < x ? y + pow(10, atoi(strchr(text, 'e') + 1) - 1) : y;
}

/* What try_cure needs. */
typedef struct cure_search {
    double *xyz; /* room for the coordinates */
    double end;  /* when to give up */
} cure_search;

static int on_cure_progress(void *user, const char *phase, double fraction)
{
    (void)phase;
    (void)fraction;
    return tool_interrupted || tool_seconds() > ((const cure_search *)user)->end;
}

/* Tries a distance. Returns 1 if it leaves no defect, 0 if it does (also where it moves nothing),
 * -1 if that is not known. */
static int try_cure(const job *j, weld_cure *c, cure_search *search)
{
    mesher_surface welded = j->surface;
    mesher_options options = j->set.mesher;
    mesher_report report;
    mesher_result result;
    uint64_t num_moved = 0;
    memcpy(search->xyz, j->in.xyz, 3 * j->in.num_vertices * sizeof *search->xyz);
    memset(&report, 0, sizeof report);
    welded.xyz = search->xyz;
    options.host.progress = on_cure_progress;
    options.host.user = search;
    options.host.log = NULL;
    result = mesher_weld(search->xyz, j->in.num_vertices, c->distance, &options.host, &num_moved);
    if (result == MESHER_OK && num_moved == 0) return 0;
    if (result == MESHER_OK) result = mesher_check(&welded, &options, &report);
    c->num_gone = report.counts[MESHER_NOTE_REPEATED_INDEX];
    if (c->num_gone > j->report.counts[MESHER_NOTE_REPEATED_INDEX])
        c->num_gone -= j->report.counts[MESHER_NOTE_REPEATED_INDEX];
    else c->num_gone = 0;
    return result == MESHER_OK ? 1 : result == MESHER_ERROR_SURFACE ? 0 : -1;
}

static const double *surface_corner(const mesher_surface *s, uint32_t triangle, int i)
{
    return s->xyz + 3 * (size_t)s->triangles[3 * (size_t)triangle + (size_t)i];
}

/* The distance that joins two corners of each pair of triangles that are in each other's way; 0 if
 * there is no such pair. */
static double closest_corners(const job *j)
{
    const mesher_surface *s = &j->surface;
    double most = 0;
    size_t i;
    int a, b;
    for (i = 0; i < j->report.num_findings; i++) {
        const mesher_finding *f = &j->report.findings[i];
        double least = HUGE_VAL;
        if (!mesher_is_defect(f->kind) || f->triangles[0] >= s->num_triangles ||
            f->triangles[1] >= s->num_triangles)
            continue;
        for (a = 0; a < 3; a++)
            for (b = 0; b < 3; b++) {
                const double *p = surface_corner(s, f->triangles[0], a);
                const double *q = surface_corner(s, f->triangles[1], b);
                const double d = hypot(hypot(p[0] - q[0], p[1] - q[1]), p[2] - q[2]);
                if (d > 0) least = fmin(least, d);
            }
        most = fmax(most, least);
    }
    return most;
}

/* Looks for a distance with which --weld leaves no defect, first about the one that joins all
 * nearly equal vertices: where triangles are as small as that, some distances turn them over. Where
 * the surface is closed, and so no nearly equal vertices are noted, it looks first for those that
 * rounding may have made. The last is the one that joins corners of the triangles found, if it is
 * small. It takes a few times as long as the check did, but not longer than some seconds. */
static void find_cure(job *j)
{
    static const double if_open[] = {1, 2, 4, 0.5, 0.25, 8, 16, 32, 64, 128},
                        if_closed[] = {0.001, 0.03, 0.25, 1};
    const int is_open = j->report.counts[MESHER_NOTE_NEAR_VERTEX] > 0 ||
                        j->report.counts[MESHER_NOTE_OPEN_EDGE] > 0;
    const int tries = is_open ? (int)(sizeof if_open / sizeof if_open[0]) : 4;
    const double some = nearly(j), most = 1000 * some, start = tool_seconds();
    cure_search search;
    int k, cured = 0;
    if (j->set.weld > 0 || j->set.refine_mesh || j->surface.xyz != j->in.xyz || !(some > 0))
        return;
    search.end = start + fmin(5, 0.5 + 4 * fmax(j->report.seconds_check, j->seconds[PHASE_CHECK]));
    if (j->set.max_seconds > 0) search.end = fmin(search.end, j->start + j->set.max_seconds);
    search.xyz = (double *)malloc(3 * j->in.num_vertices * sizeof *search.xyz);
    if (!search.xyz) return;
    for (k = 0; k <= tries && cured == 0; k++) {
        double d = k == tries ? closest_corners(j) : (is_open ? if_open[k] : if_closed[k]) * some;
        if (!(d > 0 && d <= most)) continue;
        j->cure.distance = rounded_up(d);
        cured = try_cure(j, &j->cure, &search);
    }
    free(search.xyz);
    j->cure.state = cured > 0 ? CURE_FOUND : cured < 0 ? CURE_UNKNOWN : CURE_NONE;
}

/* Says what --weld would do, if a cure was found; none: a word for no defect. */
static void say_cure(const weld_cure *c, const char *none, char text[100])
{
    int n;
    text[0] = 0;
    if (c->state != CURE_FOUND) return;
    n = snprintf(text, 100, "with --weld %.2g there is %s", c->distance, none);
    if (c->num_gone)
        snprintf(text + n, 100 - (size_t)n, ", and %llu triangles vanish",
                 (unsigned long long)c->num_gone);
}

/* Prints what --weld would do about nearly equal vertices. */
static void print_cure(const job *j)
{
    char text[100];
    say_cure(&j->cure, "no defect", text);
    if (text[0]) printf(": %s", text);
    else
        printf(": --weld %.2g makes them equal%s", rounded_up(nearly(j)),
               j->cure.state == CURE_NONE ? ", but leaves defects" : "");
}

/* Whether some defect involves a line: the numbers of lines follow those of the triangles. */
static int line_is_defective(const job *j)
{
    size_t i, n = j->surface.num_triangles;
    for (i = 0; i < j->report.num_findings; i++) {
        const mesher_finding *f = &j->report.findings[i];
        const uint32_t *t = f->triangles;
        if (mesher_is_defect(f->kind) && ((t[0] != DELAUNAY_NO_ID && t[0] >= n) ||
                                          (t[1] != DELAUNAY_NO_ID && t[1] >= n)))
            return 1;
    }
    return 0;
}

/* Has the search for pairs ended before it had found all of this kind? */
static int is_lower_bound(const job *j, int kind)
{
    return !mesher_counts_all(&j->report) &&
           (kind == MESHER_DEFECT_T_JUNCTION || kind == MESHER_DEFECT_OVERLAP ||
            kind == MESHER_DEFECT_INTERSECTION);
}

/* Prints what of the file is left out. Returns whether anything is. */
static int print_left_out(const job *j, const char *title)
{
    const meshio_mesh *in = &j->in;
    size_t i, volumes = 0, other = in->num_other - in->num_solids - in->num_thin;
    int any = 0;
    if (in->num_spare)
        printf("%-11s %llu x node at no corner, not in the mesh: in the middle of an element, or "
               "saved as a point of no group%s\n",
               any++ ? "" : title, (unsigned long long)in->num_spare,
               j->set.mesher.drop_unused ? "" : "; --drop-unused leaves it out of OUTPUT");
    if (in->num_regrouped)
        printf("%-11s %llu x element in one more physical group: the first one counts\n",
               any++ ? "" : title, (unsigned long long)in->num_regrouped);
    for (i = 0; i < in->num_regions; i++) volumes += in->regions[5 * i + 4] > 0;
    if (volumes)
        printf("%-11s %llu x largest volume of a region, not used: see --region-size\n",
               any++ ? "" : title, (unsigned long long)volumes);
    if (in->num_solids)
        printf("%-11s %llu x hexahedron, prism, pyramid or the like, not read\n",
               any++ ? "" : title, (unsigned long long)in->num_solids);
    if (in->num_thin)
        printf("%-11s %llu x face of fewer than three corners, not read\n", any++ ? "" : title,
               (unsigned long long)in->num_thin);
    if (other)
        printf("%-11s %llu x point, line or other element of a kind that is not read\n",
               any++ ? "" : title, (unsigned long long)other);
    return any;
}

static void print_counts(const job *j, const char *title, int defects)
{
    int k, any = defects ? 0 : print_left_out(j, title);
    for (k = 0; k < MESHER_NUM_KINDS; k++) {
        if (mesher_is_defect((mesher_kind)k) != defects || j->report.counts[k] == 0) continue;
        printf("%-11s %s%llu x %s", any++ ? "" : title, is_lower_bound(j, k) ? "at least " : "",
               (unsigned long long)j->report.counts[k], mesher_kind_string((mesher_kind)k));
        if (k == MESHER_NOTE_UNUSED_VERTEX)
            fputs(j->set.mesher.drop_unused
                      ? ", left out"
                      : ": nodes of the mesh where they are in it; --drop-unused leaves them out",
                  stdout);
        if (k == MESHER_NOTE_DUPLICATE_VERTEX && !j->set.mesher.drop_unused)
            fputs(": in OUTPUT, but in no element; --drop-unused leaves them out", stdout);
        if (k == MESHER_NOTE_NEAR_VERTEX)
            print_cure(j);
        putchar('\n');
    }
    if (any && (defects || j->set.verbose || j->set.check ||
                j->report.counts[MESHER_NOTE_OUTSIDE_SEED] || /* its place shows what is wrong */
                j->report.counts[MESHER_NOTE_SHARED_CELL]))
        print_findings(j, defects);
}

static int code_of(mesher_result result)
{
    switch (result) {
    case MESHER_OK: return TOOL_OK;
    case MESHER_STOPPED_BY_BUDGET:
    case MESHER_GOAL_NOT_MET: return TOOL_GOAL_NOT_MET;
    case MESHER_ERROR_INVALID_ARGUMENT: return TOOL_USAGE;
    case MESHER_ERROR_SURFACE: return TOOL_BAD_SURFACE;
    case MESHER_ERROR_RECOVERY: return TOOL_NOT_RECOVERED;
    case MESHER_ERROR_OUT_OF_MEMORY:
    case MESHER_ERROR_TOO_LARGE: return TOOL_NO_MEMORY;
    case MESHER_CANCELLED: return TOOL_STOPPED;
    default: return TOOL_INTERNAL;
    }
}

/* Whether all that is wrong may be T-junctions, and what they lead to. */
static int may_split(const job *j)
{
    const uint64_t *n = j->report.counts;
    return !j->set.split_edges && !j->set.refine_mesh &&
           (n[MESHER_DEFECT_T_JUNCTION] || n[MESHER_DEFECT_COLLINEAR]) &&
           !n[MESHER_DEFECT_OVERLAP] && !n[MESHER_DEFECT_INTERSECTION];
}

/* Reports a failure of the mesher. */
static int fail(job *j, mesher_result result)
{
    char text[sizeof j->message], message[512], advice[100];
    int code = code_of(result);
    if (code == TOOL_BAD_SURFACE) find_cure(j);
    clear_progress(j);
    if (code == TOOL_BAD_SURFACE || code == TOOL_NOT_RECOVERED) {
        if (!j->set.quiet) {
            print_counts(j, "defects", 1);
            print_counts(j, "notes", 0);
        }
        write_defects(j);
    }
    if (code == TOOL_NOT_RECOVERED) write_reproducer(j, result);
    describe_report(j, message);
    say_cure(&j->cure, "none", advice);
    if (code == TOOL_NO_MEMORY && j->set.mesher.host.memory_limit_bytes)
        snprintf(advice, sizeof advice, "--max-memory allows %.9g MB",
                 1e-6 * (double)j->set.mesher.host.memory_limit_bytes);
    snprintf(text, sizeof text, "%s%s%s%s",
             code == TOOL_STOPPED   ? "interrupted"
             : message[0] ? message : mesher_result_string(result),
             code == TOOL_BAD_SURFACE && line_is_defective(j)
                 ? "; --no-lines leaves the lines of the input out, if they are not needed"
             : code == TOOL_BAD_SURFACE && j->report.counts[MESHER_DEFECT_OUTSIDE_FACET]
                 ? "; --drop-outside leaves out triangles outside every cell"
             : code == TOOL_BAD_SURFACE && may_split(j)
                 ? "; --split-edges may mend this" : "",
             advice[0] ? "; " : "", advice);
    return complain(j, text, code);
}

static int check_surface(job *j)
{
    mesher_result result;
    double start = tool_seconds();
    result = mesher_check(&j->surface, &j->set.mesher, &j->report);
    j->seconds[PHASE_CHECK] = tool_seconds() - start;
    if (result < 0) return fail(j, result);
    clear_progress(j);
    if (!j->set.quiet) {
        printf("input       %s: %llu vertices, %llu triangles\n", j->name,
               (unsigned long long)j->in.num_vertices, (unsigned long long)num_in_file(j));
        print_counts(j, "notes", 0);
        printf("defects     none (%.3f s)\n", j->seconds[PHASE_CHECK]);
    }
    return TOOL_OK;
}

/* ---- triangles with vertices on their edges ---- */

/* A vertex inside edge k of a triangle, from corner k to the next. */
typedef struct edge_cut {
    uint32_t triangle, vertex;
    int edge;
    double distance; /* from corner k */
} edge_cut;

static int compare_cuts(const void *p, const void *q)
{
    const edge_cut *a = (const edge_cut *)p, *b = (const edge_cut *)q;
    if (a->triangle != b->triangle) return a->triangle < b->triangle ? -1 : 1;
    if (a->edge != b->edge) return a->edge < b->edge ? -1 : 1;
    if (a->distance < b->distance || a->distance > b->distance)
        return a->distance < b->distance ? -1 : 1;
    return a->vertex < b->vertex ? -1 : a->vertex > b->vertex;
}

static double distance(const double *xyz, uint32_t a, uint32_t b)
{
    double d = 0;
    size_t k;
    for (k = 0; k < 3; k++) d = hypot(d, xyz[3 * (size_t)a + k] - xyz[3 * (size_t)b + k]);
    return d;
}

static int same_place(const meshio_mesh *m, uint32_t a, uint32_t b)
{
    const double *x = m->xyz + 3 * (size_t)a, *y = m->xyz + 3 * (size_t)b;
    int k = 0;
    while (k < 3 && !(x[k] < y[k] || x[k] > y[k])) k++;
    return k == 3;
}

/* Takes the cut that a T-junction asks for. Returns 0 if it is none of a triangle's edge. */
static int take_cut(const meshio_mesh *m, const mesher_finding *f, edge_cut *cut)
{
    const uint32_t *t, a = f->vertices[1], b = f->vertices[2];
    int k;
    if (f->kind != MESHER_DEFECT_T_JUNCTION || f->triangles[1] >= m->num_triangles ||
        f->vertices[0] >= m->num_vertices || a >= m->num_vertices || b >= m->num_vertices)
        return 0;
    t = m->triangles + 3 * (size_t)f->triangles[1];
    for (k = 0; k < 3; k++) {
        const uint32_t from = t[k], to = t[(k + 1) % 3];
        if (!(same_place(m, from, a) && same_place(m, to, b)) &&
            !(same_place(m, from, b) && same_place(m, to, a)))
            continue;
        cut->triangle = f->triangles[1];
        cut->vertex = f->vertices[0];
        cut->edge = k;
        cut->distance = distance(m->xyz, cut->vertex, from);
        return 1;
    }
    return 0;
}

static int on_one_line(const meshio_mesh *m, uint32_t a, uint32_t b, uint32_t c)
{
    return delaunay_collinear(m->xyz + 3 * (size_t)a, m->xyz + 3 * (size_t)b,
                              m->xyz + 3 * (size_t)c);
}

/* Whether n corners without number i are all on one line. */
static int rest_is_flat(const meshio_mesh *m, const uint32_t *v, size_t n, size_t i)
{
    const uint32_t a = v[i == 0], b = v[i <= 1 ? 2 : 1];
    size_t k;
    for (k = 0; k < n; k++)
        if (k != i && !on_one_line(m, a, b, v[k])) return 0;
    return 1;
}

/* Divides a triangle whose n corners include those within its edges; writes n - 2 triangles, none
 * of them collinear. v is used up. */
static void divide(const meshio_mesh *m, uint32_t *v, size_t n, uint32_t *out)
{
    size_t i, k;
    for (; n > 3; n--) {
        for (i = 0; i + 1 < n; i++) /* the last one is an ear if the others are not */
            if (!on_one_line(m, v[(i + n - 1) % n], v[i], v[i + 1]) && !rest_is_flat(m, v, n, i))
                break;
        out[0] = v[(i + n - 1) % n];
        out[1] = v[i];
        out[2] = v[(i + 1) % n];
        out += 3;
        for (k = i; k + 1 < n; k++) v[k] = v[k + 1];
    }
    memcpy(out, v, 3 * sizeof *v);
}

/* Cuts the triangles of the input, and leaves out those marked in drop. Returns 0 if memory runs
 * out. */
static int cut_triangles(job *j, const edge_cut *cuts, size_t num_cuts, const uint8_t *drop)
{
    meshio_mesh *m = &j->in;
    const size_t most = m->num_triangles + num_cuts;
    uint32_t *triangles = (uint32_t *)malloc((3 * most + 1) * sizeof *triangles);
    int32_t *tags = (int32_t *)malloc((most + 1) * sizeof *tags);
    uint32_t *v = (uint32_t *)malloc((num_cuts + 3) * sizeof *v);
    uint32_t *from = (uint32_t *)malloc((most + 1) * sizeof *from);
    size_t t, n, c = 0, count = 0;
    int k, ok = triangles && tags && v && from;
    for (t = 0; ok && t < m->num_triangles; t++) {
        for (n = 0, k = 0; k < 3; k++) {
            v[n++] = m->triangles[3 * t + (size_t)k];
            for (; c < num_cuts && cuts[c].triangle == t && cuts[c].edge == k; c++)
                if (!same_place(m, v[n - 1], cuts[c].vertex)) v[n++] = cuts[c].vertex;
        }
        j->num_collinear += drop[t];
        if (drop[t]) continue;
        j->num_cut += n > 3;
        for (k = 0; k < (int)n - 2; k++) {
            tags[count + (size_t)k] = m->triangle_tags[t];
            from[count + (size_t)k] = j->cut_from ? j->cut_from[t] : (uint32_t)t;
        }
        divide(m, v, n, triangles + 3 * count);
        count += n - 2;
    }
    free(v);
    if (!ok) {
        free(triangles);
        free(tags);
        free(from);
        return 0;
    }
    if (!j->cut_from) j->num_uncut = m->num_triangles;
    free(j->cut_from);
    j->cut_from = from;
    free(m->triangles);
    free(m->triangle_tags);
    m->triangles = triangles;
    m->triangle_tags = tags;
    m->num_triangles = count;
    return 1;
}

/* For --split-edges: one round of cuts. *done: there is nothing to cut. */
static mesher_result split_once(job *j, mesher_report *report, int *done)
{
    meshio_mesh *m = &j->in;
    mesher_surface surface;
    mesher_result result;
    edge_cut *cuts;
    uint8_t *drop;
    size_t i, n = 0, dropped = 0;
    int ok;
    memset(&surface, 0, sizeof surface);
    surface.xyz = m->xyz;
    surface.num_vertices = m->num_vertices;
    surface.triangles = m->triangles;
    surface.num_triangles = m->num_triangles;
    result = mesher_check(&surface, &j->set.mesher, report);
    *done = result != MESHER_ERROR_SURFACE;
    if (*done) return result;
    cuts = (edge_cut *)malloc((report->num_findings + 1) * sizeof *cuts);
    drop = (uint8_t *)calloc(m->num_triangles + 1, 1);
    ok = cuts && drop;
    for (i = 0; ok && i < report->num_findings; i++) {
        const mesher_finding *f = &report->findings[i];
        n += (size_t)take_cut(m, f, &cuts[n]);
        if (f->kind != MESHER_DEFECT_COLLINEAR || f->triangles[0] >= m->num_triangles) continue;
        drop[f->triangles[0]] = 1;
        dropped++;
    }
    *done = n == 0 && dropped == 0;
    if (ok && !*done) {
        qsort(cuts, n, sizeof *cuts, compare_cuts);
        ok = cut_triangles(j, cuts, n, drop);
    }
    free(cuts);
    free(drop);
    return ok ? MESHER_OK : MESHER_ERROR_OUT_OF_MEMORY;
}

/* Cuts triangles at vertices that are exactly on their edges, and leaves out those that are
 * collinear, if --split-edges asks for it: the geometry stays as it is. */
static int split_edges(job *j)
{
    enum { MOST_ROUNDS = 10 };
    double start = tool_seconds();
    mesher_report report;
    mesher_result result = MESHER_OK;
    int round, done = !j->set.split_edges;
    memset(&report, 0, sizeof report);
    report.cap_findings = MAX_FINDINGS;
    if (!done) report.findings = (mesher_finding *)malloc(MAX_FINDINGS * sizeof *report.findings);
    if (!done && !report.findings) result = MESHER_ERROR_OUT_OF_MEMORY;
    for (round = 0; round < MOST_ROUNDS && !done && result == MESHER_OK; round++)
        result = split_once(j, &report, &done);
    free(report.findings);
    j->seconds[PHASE_READ] += tool_seconds() - start;
    if (result == MESHER_OK || result == MESHER_ERROR_SURFACE) return TOOL_OK; /* told later */
    return complain(j, mesher_result_string(result), code_of(result));
}

/* ---- proof that the surface came back ---- */

/* The distinct facets of the surface: a hash table by their three vertices. */
typedef struct facet_set {
    const mesher_domain *domain;
    uint32_t *table; /* open addressing, DELAUNAY_NO_ID: empty */
    size_t mask;
    unsigned char *seen; /* by facet: whether the mesh has it */
} facet_set;

static size_t facet_slot(const facet_set *set, const uint32_t v[3])
{
    uint64_t h = v[0];
    size_t slot;
    h = (h ^ h >> 29) * UINT64_C(0x9E3779B97F4A7C15) + v[1];
    h = (h ^ h >> 29) * UINT64_C(0xBF58476D1CE4E5B9) + v[2];
    h = (h ^ h >> 32) * UINT64_C(0x94D049BB133111EB);
    for (slot = (size_t)(h >> 20) & set->mask;; slot = (slot + 1) & set->mask) {
        uint32_t f = set->table[slot];
        if (f == DELAUNAY_NO_ID ||
            memcmp(set->domain->facets + 3 * (size_t)f, v, 3 * sizeof *v) == 0)
            return slot;
    }
}

static int facet_set_init(facet_set *set, const mesher_domain *domain)
{
    size_t size = 1024;
    uint32_t f;
    while (size < 2 * (size_t)domain->num_facets) size *= 2;
    set->domain = domain;
    set->mask = size - 1;
    set->table = (uint32_t *)malloc(size * sizeof(uint32_t));
    set->seen = (unsigned char *)calloc((size_t)domain->num_facets + 1, 1);
    if (!set->table || !set->seen) return 0;
    memset(set->table, 255, size * sizeof(uint32_t));
    for (f = 0; f < domain->num_facets; f++)
        set->table[facet_slot(set, domain->facets + 3 * (size_t)f)] = f;
    return 1;
}

/* The input ids of the corners of facet i of tetrahedron t, ascending. */
static void facet_ids(const delaunay_mesh *mesh, delaunay_handle t, int i, uint32_t id[3])
{
    int k, n = 0;
    for (k = 0; k < 4; k++)
        if (k != i) id[n++] = mesh->vertex_id[mesh->tets[t].v[k]];
    tool_ascend(id);
}

/* Marks as seen the facets of tetrahedron t that are facets of the surface; runs in many threads at
 * once. Returns 0 if a region ends at a facet that is none of the surface. */
static int see_facets(const mesher_domain *domain, facet_set *set, delaunay_handle t)
{
    const delaunay_mesh *mesh = &domain->mesh;
    int i;
    if (delaunay_is_deleted(mesh, t) || delaunay_is_ghost(mesh, t)) return 1;
    for (i = 0; i < 4; i++) {
        delaunay_handle n = mesh->tets[t].n[i] / 4;
        uint32_t id[3], f;
        int border =
            mesh->color[t] != DELAUNAY_OUTSIDE && (n == 0 || mesh->color[n] != mesh->color[t]);
        if (!border && !(mesh->flags[t] & DELAUNAY_FACET_BIT(i))) continue;
        facet_ids(mesh, t, i, id);
        f = set->table[facet_slot(set, id)];
        if (f == DELAUNAY_NO_ID) {
            if (border) return 0;
            continue;
        }
#ifdef _OPENMP
#    pragma omp atomic write
#endif
        set->seen[f] = 1;
    }
    return 1;
}

/* Whether every facet of the surface is a facet of the mesh, and regions end only at facets of the
 * surface. Returns 1: yes; 0: no; -1: out of memory. */
static int surface_came_back(const mesher_domain *domain, const delaunay_host *host)
{
    long t, num_tets = (long)domain->mesh.num_tets;
    int whole = 1, threads = delaunay_threads(host);
    facet_set set;
    uint32_t f, seen = 0;
    memset(&set, 0, sizeof set);
    if (!facet_set_init(&set, domain)) {
        free(set.table);
        free(set.seen);
        return -1;
    }
    (void)threads;
#ifdef _OPENMP
#    pragma omp parallel for schedule(static) num_threads(threads) reduction(min : whole)
#endif
    for (t = 1; t < num_tets; t++)
        if (!see_facets(domain, &set, (delaunay_handle)t)) whole = 0;
    for (f = 0; f < domain->num_facets; f++) seen += set.seen[f];
    free(set.table);
    free(set.seen);
    return whole && seen == domain->num_facets;
}

static int prove(job *j)
{
    delaunay_report proof;
    double start = tool_seconds();
    int whole;
    memset(&proof, 0, sizeof proof);
    if (delaunay_validate_on(&j->domain.mesh, DELAUNAY_VALIDATE_GEOMETRY, &j->set.mesher.host,
                             &proof) != DELAUNAY_OK) {
        char text[300];
        snprintf(text, sizeof text, "internal error: %s", proof.message);
        return complain(j, text, TOOL_INTERNAL);
    }
    whole = j->report.surface_steiner ? 1 : surface_came_back(&j->domain, &j->set.mesher.host);
    j->seconds[PHASE_PROVE] = tool_seconds() - start;
    if (whole < 0) return complain(j, "out of memory", TOOL_NO_MEMORY);
    return whole ? TOOL_OK
                 : complain(j, "internal error: the mesh does not hold the whole surface",
                            TOOL_INTERNAL);
}

/* ---- meshing ---- */

/* Makes malloc give blocks of 4 MiB and more back to the system when they are freed. Without this,
 * glibc raises the limit each time a larger block is freed. */
static void return_large_blocks(void)
{
#ifdef __GLIBC__
    mallopt(M_MMAP_THRESHOLD, 4 << 20);
#endif
}

/* Gives the memory that the phases so far have freed between blocks in use back to the system. */
static void trim_memory(void)
{
#ifdef __GLIBC__
    malloc_trim(0);
#endif
}

/* What is left of --max-seconds; 0: there is no limit. */
static double seconds_left(const job *j)
{
    const double left = j->set.max_seconds - (tool_seconds() - j->start);
    return j->set.max_seconds > 0 ? fmax(left, 1e-3) : 0;
}

static void improve(job *j)
{
    double start = tool_seconds();
    spr_result result;
    if (j->set.no_improve) {
        spr_measure_mesh(&j->domain.mesh, &j->set.spr, &j->quality);
        if (!j->set.spr.require_target || j->quality.num_below == 0) return;
        clear_progress(j);
        complain(j, "some tetrahedra are below the target", TOOL_GOAL_NOT_MET);
        if (j->code == TOOL_OK) j->code = TOOL_GOAL_NOT_MET;
        return;
    }
    j->set.spr.max_seconds = seconds_left(j);
    result = spr_improve(&j->domain.mesh, &j->set.spr, &j->spr);
    j->quality = j->spr.after;
    j->seconds[PHASE_IMPROVE] = tool_seconds() - start;
    if (result == SPR_OK) return;
    clear_progress(j);
    j->code = complain(j,
                       result == SPR_CANCELLED ? "improvement was interrupted; the mesh is valid"
                       : result == SPR_STOPPED_BY_BUDGET ? "--max-seconds ended improvement"
                       : j->spr.message[0]               ? j->spr.message
                                                         : spr_result_string(result),
                       result == SPR_ERROR_INTERNAL || result == SPR_ERROR_INVALID_MESH ||
                               result == SPR_ERROR_INVALID_ARGUMENT
                           ? TOOL_INTERNAL
                           : TOOL_GOAL_NOT_MET); /* the mesh is valid, if not as good as could be */
    if (result < 0) spr_measure_mesh(&j->domain.mesh, &j->set.spr, &j->quality);
}

/* Keeps what the report says of the surface of the file: that of the divided one goes elsewhere. */
static int keep_notes(job *j)
{
    j->notes = j->report;
    j->report.findings = (mesher_finding *)malloc(MAX_FINDINGS * sizeof(mesher_finding));
    if (j->report.findings) return 1;
    j->report.findings = j->notes.findings;
    j->notes.findings = NULL;
    return 0;
}

/* Says again what was found in the surface of the file, in its own numbers. */
static void restore_notes(job *j)
{
    free(j->report.findings);
    j->report.findings = j->notes.findings;
    j->report.num_findings = j->notes.num_findings;
    j->report.input_triangles = j->notes.input_triangles; /* a larger number is a line's */
    memcpy(j->report.counts, j->notes.counts, sizeof j->report.counts);
    j->notes.findings = NULL;
}

/* Replaces the surface by a finer one, for --refine-surface, or by one with other diagonals. */
static int change_surface(job *j)
{
    double start = tool_seconds();
    mesher_result result;
    j->set.mesher.max_seconds = seconds_left(j) / 4; /* meshing the inside takes longer */
    result = (j->set.refine_surface ? mesher_refine_surface : mesher_flip_surface)(
        &j->fine, &j->surface, &j->set.mesher, &j->report);
    if (result < 0) return fail(j, result);
    if (result > 0) {
        clear_progress(j);
        j->code = complain(j, "a budget ended the division of the surface", TOOL_GOAL_NOT_MET);
    }
    if (!keep_notes(j)) return fail(j, MESHER_ERROR_OUT_OF_MEMORY);
    j->surface = j->fine.surface;
    j->seconds[PHASE_SURFACE] = tool_seconds() - start;
    return TOOL_OK;
}

/* Reports the sizes of --region-size for regions that do not exist. */
static void note_region_sizes(const job *j)
{
    size_t n;
    uint32_t i;
    for (n = 0; n < j->set.mesher.num_region_sizes && !j->set.quiet; n++) {
        if (!(j->set.region_sizes[n] > 0)) continue;
        for (i = 0; i < j->domain.num_regions; i++)
            if (j->domain.regions[i].kept && j->domain.regions[i].number == n + 1) break;
        if (i == j->domain.num_regions)
            fprintf(stderr, "mesh: there is no region %lu for --region-size\n",
                    (unsigned long)n + 1);
    }
}

static int asks_for_sizes(const mesher_options *o)
{
    return o->size > 0 || o->max_size > 0 || o->layers > 0 || o->curvature_degrees > 0 ||
           o->size_grid || o->size_mesh || o->num_sources > 0 || o->num_region_sizes > 0;
}

/* The number of triangles with an edge more than three times as long as is wanted at its ends. */
static uint64_t num_large(const job *j)
{
    const mesher_domain *domain = &j->domain;
    uint64_t count = 0;
    size_t i;
    int k, c;
    for (i = 0; i < j->surface.num_triangles; i++)
        for (k = 0; k < 3; k++) {
            const uint32_t *v = j->surface.triangles + 3 * i;
            const uint32_t p = v[k], q = v[(k + 1) % 3];
            const double *a = j->surface.xyz + 3 * (size_t)p, *b = j->surface.xyz + 3 * (size_t)q;
            const double g = domain->size[domain->mesh.vertex_of[p]],
                         h = domain->size[domain->mesh.vertex_of[q]], most = 3 * (g + h) / 2;
            double ll = 0;
            for (c = 0; c < 3; c++) ll += (b[c] - a[c]) * (b[c] - a[c]);
            if (!(g > 0 && h > 0 && ll > most * most)) continue; /* 0: in no region */
            count++;
            break;
        }
    return count;
}

/* The number of diagonals within planes that could be flipped; 0 if they are few, if the surface
 * holds few tetrahedra below the target, or if nobody would read it. */
static uint64_t num_flips(job *j)
{
    uint64_t count = 0;
    if (j->set.quiet || 100 * j->spr.bounded < j->quality.num_tets || changes_surface(&j->set) ||
        j->set.refine_mesh || mesher_count_flips(&j->domain, &count) != MESHER_OK)
        return 0;
    return 50 * count < j->surface.num_triangles ? 0 : count;
}

/* For --save-sizes: copies the mesh as refinement leaves it, as a size mesh with the sizes at its
 * vertices; improvement moves vertices. Returns 0 if memory runs out. */
static int keep_sizes(job *j)
{
    const delaunay_mesh *m = &j->domain.mesh;
    const size_t vertices = m->num_vertices, tets = (size_t)m->num_tets;
    mesher_size_mesh *kept = &j->kept_sizes;
    delaunay_handle t;
    uint32_t v;
    if (!j->domain.size && mesher_size(&j->domain, NULL) != MESHER_OK) return 0;
    if (vertices > (size_t)-1 / 24 || tets > (size_t)-1 / 16) return 0;
    j->kept_xyz = (double *)malloc(vertices * 3 * sizeof *j->kept_xyz);
    j->kept_tets = (uint32_t *)malloc(tets * 4 * sizeof *j->kept_tets);
    if (!j->kept_xyz || !j->kept_tets) return 0;
    for (v = 0; v < vertices; v++) memcpy(j->kept_xyz + 3 * (size_t)v, m->vertices[v].x, 24);
    for (t = 1; t < m->num_tets; t++)
        if (!delaunay_is_deleted(m, t) && !delaunay_is_ghost(m, t) &&
            m->color[t] != DELAUNAY_OUTSIDE)
            memcpy(j->kept_tets + 4 * kept->num_tets++, m->tets[t].v, 4 * sizeof(uint32_t));
    kept->xyz = j->kept_xyz;
    kept->num_vertices = vertices;
    kept->tets = j->kept_tets;
    kept->size = j->domain.size;
    return mesher_size_mesh_init(kept, &j->set.mesher.host, NULL) == MESHER_OK;
}

/* Says which budget ended refinement, by the option of this program that has set it. */
static void complain_of_budget(job *j)
{
    static const char *const members[4] = {"max_vertices, ", "max_tets, ", "max_seconds, ",
                                           "host.memory_limit_bytes, "},
                      *const options[4] = {"--max-vertices", "--max-tets", "--max-seconds",
                                           "--max-memory"};
    const mesher_options *o = &j->set.mesher;
    const double values[4] = {(double)o->max_vertices, (double)o->max_tets, j->set.max_seconds,
                              1e-6 * (double)o->host.memory_limit_bytes};
    char text[sizeof j->message];
    int k;
    for (k = 0; k < 4; k++) {
        const char *at = strstr(j->report.message, members[k]);
        if (!at) continue;
        snprintf(text, sizeof text, "%.*s%s %.15g", (int)(at - j->report.message),
                 j->report.message, options[k], values[k]);
        complain(j, text, TOOL_GOAL_NOT_MET);
        return;
    }
    complain(j, j->report.message, TOOL_GOAL_NOT_MET);
}

static void take_seconds(job *j)
{
    j->seconds[PHASE_CHECK] = j->report.seconds_check;
    j->seconds[PHASE_EMPTY] = j->report.seconds_empty;
    j->seconds[PHASE_RECOVER] = j->report.seconds_recover;
    j->seconds[PHASE_REGIONS] = j->report.seconds_regions;
    j->seconds[PHASE_SIZE] = j->report.seconds_size;
    j->seconds[PHASE_REFINE] = j->report.seconds_refine;
}

static int mesh_surface(job *j)
{
    const mesher_options *o = &j->set.mesher;
    mesher_result result;
    j->set.mesher.max_seconds = seconds_left(j);
    if (j->set.refine_mesh)
        result = mesher_refine_mesh(&j->domain, &j->surface, j->in.tets,
                                    (const uint32_t *)j->in.tet_tags, j->in.num_tets,
                                    &j->set.mesher, &j->report);
    else result = mesher_mesh(&j->domain, &j->surface, &j->set.mesher, &j->report);
    if (result == MESHER_ERROR_INVALID_ARGUMENT && j->set.refine_mesh) /* the options are right */
        return complain(j, j->report.message, TOOL_BAD_SURFACE);
    take_seconds(j);
    if (result < 0) return fail(j, result);
    if (changes_surface(&j->set)) restore_notes(j);
    note_region_sizes(j);
    if (result > 0) {
        clear_progress(j);
        if (j->report.message[0]) complain_of_budget(j);
        else complain(j, mesher_result_string(result), TOOL_GOAL_NOT_MET);
    }
    if (j->code == TOOL_OK) j->code = code_of(result);
    if (asks_for_sizes(o) && !o->no_refine && !j->set.refine_surface && !j->set.refine_mesh)
        j->num_large = num_large(j);
    if (j->set.save_sizes && !keep_sizes(j)) return fail(j, MESHER_ERROR_OUT_OF_MEMORY);
    trim_memory();
    improve(j);
    clear_progress(j);
    j->num_flips = num_flips(j);
    if (j->code == TOOL_INTERNAL) return j->code;
    return prove(j);
}

/* ---- output ---- */

/* For --drop-outside: removes the triangles that no tetrahedron has from the result. */
static void drop_outside(job *j)
{
    mesher_output *out = &j->out;
    uint64_t i, n = 0;
    for (i = 0; i < out->num_triangles; i++) {
        if (!out->triangle_regions[2 * i] && !out->triangle_regions[2 * i + 1]) continue;
        memmove(out->triangles + 3 * n, out->triangles + 3 * i, 3 * sizeof *out->triangles);
        out->triangle_tags[n++] = out->triangle_tags[i];
    }
    out->num_triangles = n;
}

/* For --drop-unused: removes the vertices that are in no element from the result, and the
 * references that they have in the file. Returns 0 if memory runs out. */
static int drop_unused(job *j)
{
    mesher_output *out = &j->out;
    const size_t n = (size_t)out->num_vertices, of_file = j->in.num_vertices;
    uint32_t *number = (uint32_t *)calloc(n + 1, sizeof *number), next = 0;
    uint64_t i;
    size_t v;
    if (!number) return 0;
    for (i = 0; i < 4 * out->num_tets; i++) number[out->tets[i]] = 1;
    for (i = 0; i < 3 * out->num_triangles; i++) number[out->triangles[i]] = 1;
    for (i = 0; i < 2 * out->num_edges; i++) number[out->edges[i]] = 1;
    for (v = 0; v < n; v++) {
        if (!number[v]) {
            j->num_dropped += v < of_file;
            continue;
        }
        memmove(out->xyz + 3 * (size_t)next, out->xyz + 3 * v, 3 * sizeof *out->xyz);
        if (v < of_file && j->in.vertex_tags) j->in.vertex_tags[next] = j->in.vertex_tags[v];
        number[v] = next++;
    }
    out->num_vertices = next;
    tool_renumber(out->tets, 4 * out->num_tets, number);
    tool_renumber(out->triangles, 3 * out->num_triangles, number);
    tool_renumber(out->edges, 2 * out->num_edges, number);
    free(number);
    return 1;
}

static double gamma_of(const mesher_output *out, uint64_t t)
{
    const uint32_t *v = out->tets + 4 * t;
    const double *x = out->xyz;
    return spr_gamma(x + 3 * (size_t)v[0], x + 3 * (size_t)v[1], x + 3 * (size_t)v[2],
                     x + 3 * (size_t)v[3]);
}

static double *output_quality(const job *j)
{
    uint64_t t;
    double *gamma = (double *)malloc(((size_t)j->out.num_tets + 1) * sizeof(double));
    for (t = 0; gamma && t < j->out.num_tets; t++) gamma[t] = gamma_of(&j->out, t);
    return gamma;
}

/* The vertices in the middles of edges: a hash table by edge. */
typedef struct middles {
    uint64_t *keys; /* (smaller << 32 | larger vertex) + 1; 0: empty */
    uint32_t *vertices;
    size_t mask;
    double *xyz;
    uint32_t num_vertices, most; /* of all vertices; xyz has room for `most` */
    int full;                    /* more were needed */
} middles;

/* The vertex in the middle of edge a-b; makes it if there is none. */
static uint32_t middle_of(middles *m, uint32_t a, uint32_t b)
{
    uint64_t key = a < b ? ((uint64_t)a << 32 | b) + 1 : ((uint64_t)b << 32 | a) + 1;
    size_t k = (size_t)((key * UINT64_C(0x9E3779B97F4A7C15)) >> 20) & m->mask;
    int i;
    while (m->keys[k] && m->keys[k] != key) k = (k + 1) & m->mask;
    if (m->keys[k]) return m->vertices[k];
    if (m->num_vertices == m->most) {
        m->full = 1;
        return a;
    }
    m->keys[k] = key;
    for (i = 0; i < 3; i++)
        m->xyz[3 * (size_t)m->num_vertices + (size_t)i] =
            0.5 * m->xyz[3 * (size_t)a + (size_t)i] + 0.5 * m->xyz[3 * (size_t)b + (size_t)i];
    m->vertices[k] = m->num_vertices;
    return m->num_vertices++;
}

/* n elements of `corners` vertices, each followed by the middles of its edges. NULL: out of
 * memory. */
static uint32_t *with_middles(middles *m, const uint32_t *v, size_t n, int corners)
{
    static const int edges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
    int each = corners == 4 ? 10 : corners == 3 ? 6 : 3, k;
    uint32_t *all = (uint32_t *)malloc((n * (size_t)each + 1) * sizeof *all);
    size_t i;
    for (i = 0; all && i < n; i++) {
        const uint32_t *from = v + i * (size_t)corners;
        uint32_t *to = all + i * (size_t)each;
        for (k = 0; k < corners; k++) to[k] = from[k];
        for (k = 0; k < each - corners; k++)
            to[corners + k] = middle_of(m, from[edges[k][0]], from[edges[k][1]]);
    }
    return all;
}

/* Replaces the elements of m by those of second order, which the caller frees even if this fails.
 * Returns 0 if there is no memory, or if the vertices would be too many. */
static int raise_order(meshio_mesh *m, raised *to)
{
    middles work;
    size_t most = 6 * m->num_tets, size = 1024;
    memset(&work, 0, sizeof work);
    if (most > m->num_vertices + 3 * m->num_tets + 65536)
        most = m->num_vertices + 3 * m->num_tets + 65536;
    if (most + m->num_vertices > UINT32_MAX - 2) return 0;
    while (size < 2 * most) size *= 2;
    work.mask = size - 1;
    work.num_vertices = (uint32_t)m->num_vertices;
    work.most = (uint32_t)(m->num_vertices + most);
    work.keys = (uint64_t *)calloc(size, sizeof *work.keys);
    work.vertices = (uint32_t *)malloc(size * sizeof *work.vertices);
    work.xyz = (double *)malloc(3 * (m->num_vertices + most) * sizeof *work.xyz);
    to->xyz = work.xyz;
    if (work.keys && work.vertices && work.xyz) {
        memcpy(work.xyz, m->xyz, 3 * m->num_vertices * sizeof *work.xyz);
        to->tets = with_middles(&work, m->tets, m->num_tets, 4);
        to->triangles = with_middles(&work, m->triangles, m->num_triangles, 3);
        to->edges = with_middles(&work, m->edges, m->num_edges, 2);
    }
    free(work.keys);
    free(work.vertices);
    if (!to->tets || !to->triangles || !to->edges || work.full) return 0;
    m->triangles = to->triangles;
    m->edges = to->edges;
    m->tets = to->tets;
    m->xyz = to->xyz;
    m->num_vertices = to->num_nodes = work.num_vertices;
    m->second_order = 1;
    return 1;
}

/* Drops the names of groups of tetrahedra, unless the regions keep their numbers. */
static void drop_names(meshio_mesh *in, int keeps_tets)
{
    size_t i, n = 0;
    for (i = 0; i < in->num_names; i++)
        if (keeps_tets || in->names[i].dimension < 3) in->names[n++] = in->names[i];
    in->num_names = n;
}

/* Gives the vertices of the input, which come first in m, the references that they have in the
 * file, and the others 0. Returns 0 if memory runs out. */
static int take_references(meshio_mesh *m, const job *j)
{
    const int32_t *tags = j->in.vertex_tags;
    const size_t n = j->in.num_vertices - j->num_dropped;
    size_t i = 0;
    while (tags && i < n && tags[i] == 0) i++;
    if (!tags || i == n) return 1;
    m->vertex_tags = (int32_t *)calloc(m->num_vertices + 1, sizeof *m->vertex_tags);
    if (!m->vertex_tags) return 0;
    memcpy(m->vertex_tags, tags, n * sizeof *tags);
    return 1;
}

/* Writes OUTPUT. The formats of viewers get the tetrahedra and their quality, the other formats the
 * tetrahedra and the surface. */
static int write_output(job *j)
{
    meshio_format format = output_format(&j->set);
    int viewer = format == MESHIO_FORMAT_VTU || format == MESHIO_FORMAT_VTK, code = TOOL_OK;
    meshio_mesh m;
    meshio_report io;
    meshio_write_options options;
    meshio_field field;
    double *gamma = NULL, start = tool_seconds();
    memset(&m, 0, sizeof m);
    memset(&options, 0, sizeof options);
    memset(&field, 0, sizeof field);
    m.xyz = j->out.xyz;
    m.num_vertices = (size_t)j->out.num_vertices;
    m.tets = j->out.tets;
    m.tet_tags = (int32_t *)j->out.regions; /* the same 32 bits */
    m.num_tets = (size_t)j->out.num_tets;
    drop_names(&j->in, j->set.refine_mesh || j->has_tet_seeds);
    m.names = j->in.names;
    m.num_names = j->in.num_names;
    if (!viewer) {
        m.triangles = j->out.triangles;
        m.triangle_tags = j->out.triangle_tags;
        m.num_triangles = (size_t)j->out.num_triangles;
        m.edges = j->out.edges;
        m.edge_tags = j->out.edge_tags;
        m.num_edges = (size_t)j->out.num_edges;
    }
    options.format = format;
    options.ascii = j->set.ascii;
    options.binary = j->set.binary;
    options.num_threads = delaunay_threads(&j->set.mesher.host);
    if (viewer) gamma = output_quality(j);
    if ((viewer && !gamma) || (j->set.order == 2 && !raise_order(&m, &j->second)) ||
        !take_references(&m, j)) {
        code = complain(j, "out of memory", TOOL_NO_MEMORY);
    } else {
        field.name = "gamma";
        field.tets = gamma;
        options.fields = &field;
        options.num_fields = viewer ? 1 : 0;
        if (meshio_write(j->set.output, &m, &options, &io) != MESHIO_OK)
            code = complain(j, io.message, TOOL_CANNOT_WRITE);
    }
    free(gamma);
    free(m.vertex_tags);
    j->seconds[PHASE_WRITE] = tool_seconds() - start;
    return code;
}

/* Writes the file of --save-sizes. */
static int save_sizes(job *j)
{
    const char *file = j->set.save_sizes;
    const double *xyz = j->second.xyz ? j->second.xyz : j->out.xyz;
    const size_t n = j->second.xyz ? j->second.num_nodes : (size_t)j->out.num_vertices;
    double *sizes, start = tool_seconds();
    meshio_report io;
    int code = TOOL_OK;
    size_t v;
    if (!file) return TOOL_OK;
    sizes = (double *)malloc((n + 1) * sizeof *sizes);
    for (v = 0; sizes && v < n; v++)
        sizes[v] = mesher_size_mesh_at(&j->kept_sizes, xyz + 3 * v);
    if (!sizes) code = complain(j, "out of memory", TOOL_NO_MEMORY);
    else if (meshio_write_sizes(file, sizes, n, &io) != MESHIO_OK)
        code = complain(j, io.message, TOOL_CANNOT_WRITE);
    free(sizes);
    j->seconds[PHASE_WRITE] += tool_seconds() - start;
    return code;
}

/* ---- statistics ---- */

static uint64_t below(const spr_statistics *q, int twentieths)
{
    uint64_t sum = 0;
    int i;
    for (i = 0; i < twentieths; i++) sum += q->histogram[i];
    return sum;
}

static double total_seconds(const job *j, int with_files)
{
    double sum = 0;
    int k;
    for (k = 0; k < NUM_PHASES; k++)
        if (with_files || (k != PHASE_READ && k != PHASE_WRITE)) sum += j->seconds[k];
    return sum;
}

static void print_bars(const char *title, const uint64_t *counts, int n, double step)
{
    uint64_t sum = 0, most = 1;
    int i, k;
    for (i = 0; i < n; i++) {
        sum += counts[i];
        if (counts[i] > most) most = counts[i];
    }
    if (sum == 0) return;
    printf("%s\n", title);
    for (i = 0; i < n; i++) {
        int length = (int)(40.0 * (double)counts[i] / (double)most + 0.5);
        printf("  %7.4g - %-7.4g %12llu %6.2f %% ", step * i, step * (i + 1),
               (unsigned long long)counts[i], 100.0 * (double)counts[i] / (double)sum);
        for (k = 0; k < length; k++) putchar('#');
        putchar('\n');
    }
}

static void print_regions(const job *j)
{
    uint32_t i, shown = 0;
    if (j->num_renamed > 0)
        printf("note        %lu of the regions got numbers that no other has: attributes must be\n"
               "            whole numbers from 1 on\n",
               (unsigned long)j->num_renamed);
    if (j->report.num_regions < 2 && !j->set.verbose) return;
    for (i = 0; i < j->domain.num_regions && shown < 20; i++) {
        const mesher_region *r = &j->domain.regions[i];
        if (!r->kept) continue;
        printf("%-11s %ld: volume %.9g\n", shown++ ? "" : "regions", (long)(int32_t)r->number,
               r->volume);
    }
}

static void print_phases(const job *j)
{
    double all = total_seconds(j, 1), work = total_seconds(j, 0);
    int k;
    for (k = 0; k < NUM_PHASES; k++)
        if (k != PHASE_SURFACE || changes_surface(&j->set))
            printf("%-11s %9.3f s %5.1f %%\n", phase_names[k], j->seconds[k],
                   all > 0 ? 100 * j->seconds[k] / all : 0);
    printf("total       %9.3f s, %d threads, %.0f tetrahedra/s without reading and writing\n", all,
           delaunay_threads(&j->set.mesher.host), work > 0 ? (double)j->out.num_tets / work : 0);
    if (tool_peak_bytes() > 0) printf("peak memory %9.1f MB\n", 1e-6 * tool_peak_bytes());
}

/* The two nearest corners of the tetrahedron of the lowest gamma. Returns their distance, and sets
 * *longest to that of the two farthest. */
static double nearest_corners(const job *j, uint32_t pair[2], double *longest)
{
    const mesher_output *out = &j->out;
    double worst = HUGE_VAL, nearest = HUGE_VAL, gamma, d;
    uint64_t t, at = 0;
    int e;
    for (t = 0; t < out->num_tets; t++) {
        gamma = gamma_of(out, t);
        if (!(gamma < worst)) continue;
        worst = gamma;
        at = t;
    }
    *longest = 0;
    for (e = 0; e < 6; e++) {
        const uint32_t a = out->tets[4 * at + delaunay_edge_order(e)[0]],
                       b = out->tets[4 * at + delaunay_edge_order(e)[1]];
        d = distance(out->xyz, a, b);
        *longest = fmax(*longest, d);
        if (!(d < nearest)) continue;
        nearest = d;
        pair[0] = a;
        pair[1] = b;
    }
    return nearest;
}

/* If a tetrahedron is practically flat as two vertices of the input are nearly equal, says so, and
 * what can be done about it. */
static void print_flat(const job *j)
{
    uint32_t pair[2] = {0, 0}, n = (uint32_t)(j->in.num_vertices - j->num_dropped);
    double longest, d;
    const double *x;
    int unused = 0, k;
    if (!(j->quality.min < 1e-6) || j->out.num_tets == 0) return;
    d = nearest_corners(j, pair, &longest);
    if (!(d < 1e-6 * longest) || pair[0] >= n || pair[1] >= n) return;
    for (k = 0; k < 2 && j->num_dropped == 0; k++)
        unused |= j->domain.vertex_used[pair[k]] == MESHER_VERTEX_ISOLATED;
    x = j->out.xyz + 3 * (size_t)pair[0];
    printf("note        the worst tetrahedron is practically flat: its vertices %lu and %lu, at\n"
           "            (%.9g, %.9g, %.9g), are only %.2g apart. ", (unsigned long)pair[0],
           (unsigned long)pair[1], x[0], x[1], x[2], d);
    if (unused) printf("--drop-unused leaves\n            out those in no triangle\n");
    else
        printf("--weld %.2g makes\n            such ones equal\n",
               rounded_up(fmax(d, 1e-3 * nearly(j))));
}

static void print_quality(const job *j)
{
    const spr_statistics *q = &j->quality;
    printf("gamma       min %.4f, 0.1 %% %.4f, 1 %% %.4f, mean %.4f; %llu below 0.35", q->min,
           q->p001, q->p01, q->mean, (unsigned long long)below(q, 7));
    if (!j->set.no_improve && below(q, 7) > 0)
        printf(":\n            %llu held by the surface, %llu with all vertices fixed,\n"
               "            %llu that nothing helps, %llu for which not everything was tried%s",
               (unsigned long long)j->spr.bounded, (unsigned long long)j->spr.fixed,
               (unsigned long long)j->spr.stuck, (unsigned long long)j->spr.unfinished,
               j->spr.unfinished && !(j->set.spr.effort > 1) ? " (--effort 4 tries more)" : "");
    printf("\nSICN        min %.4f\ndihedral    %.2f .. %.2f degrees\n", q->sicn_min,
           q->dihedral_min_degrees, q->dihedral_max_degrees);
    print_flat(j);
    print_bars("gamma", q->histogram, 20, 0.05);
    print_bars("dihedral angles", q->dihedral_histogram, 18, 10);
}

/* Prints how well refinement honours the wanted sizes. */
static void print_sizes(const job *j)
{
    const mesher_report *r = &j->report;
    if (r->refined_vertices == 0) return;
    printf("edge/size   10 %% %.2f, 50 %% %.2f, 90 %% %.2f; %.1f %% within [0.7, 1.4]\n",
           r->size_p10, r->size_p50, r->size_p90, 100 * r->size_in_band);
    if (r->size_ignored)
        printf("sizes       %llu wishes were no size (0, negative or no number) and were ignored\n",
               (unsigned long long)r->size_ignored);
}

/* Prints what --refine-surface or --flip-surface made of the triangles, or a note if the mesh would
 * gain by one of them, or if sizes were given in vain. */
static void print_division(const job *j)
{
    if (changes_surface(&j->set))
        printf("surface     %llu vertices, %llu triangles, %s%llu flips\n",
               (unsigned long long)j->surface.num_vertices,
               (unsigned long long)j->surface.num_triangles,
               j->set.refine_surface ? "divided, " : "", (unsigned long long)j->fine.num_flips);
    if (j->num_large > 0)
        printf("note        %llu triangles have edges more than three times as long as is asked\n"
               "            for; tetrahedra under them are flat. --refine-surface divides them\n",
               (unsigned long long)j->num_large);
    if (j->num_flips > 0)
        printf("note        %llu diagonals could be flipped within planes of the surface, for\n"
               "            fewer needles, which hold bad tetrahedra: --flip-surface does it\n",
               (unsigned long long)j->num_flips);
    if (j->set.mesher.no_refine && !j->set.refine_surface && asks_for_sizes(&j->set.mesher))
        printf("note        --no-refine: the sizes have no effect\n");
}

static void print_statistics(const job *j)
{
    uint64_t n = j->out.num_vertices, added = n - (j->in.num_vertices - j->num_dropped);
    printf("input       %s: %llu vertices, %llu triangles\n", j->name,
           (unsigned long long)j->in.num_vertices, (unsigned long long)num_in_file(j));
    if (j->set.weld > 0)
        printf("weld        %llu vertices put onto others\n", (unsigned long long)j->num_welded);
    if (j->set.split_edges)
        printf("split       %llu triangles cut at vertices on their edges, %llu collinear ones "
               "left out\n", (unsigned long long)j->num_cut, (unsigned long long)j->num_collinear);
    print_counts(j, "notes", 0);
    print_division(j);
    if (j->set.output) printf("output      %s\n", j->set.output);
    printf("vertices    %llu, %llu new, of them %llu on the surface", (unsigned long long)n,
           (unsigned long long)added,
           (unsigned long long)(j->report.surface_steiner + j->surface.num_vertices -
                                j->in.num_vertices));
    if (j->num_dropped) printf("; %llu of INPUT left out", (unsigned long long)j->num_dropped);
    putchar('\n');
    printf("tetrahedra  %llu in %llu region%s\n", (unsigned long long)j->out.num_tets,
           (unsigned long long)j->report.num_regions, j->report.num_regions == 1 ? "" : "s");
    print_regions(j);
    print_sizes(j);
    print_phases(j);
    print_quality(j);
}

static void json_quality(FILE *f, const spr_statistics *q)
{
    fprintf(f, "  ");
    tool_json_value(f, "gamma_min", q->min, ", ");
    tool_json_value(f, "gamma_p001", q->p001, ", ");
    tool_json_value(f, "gamma_p01", q->p01, ", ");
    tool_json_value(f, "gamma_mean", q->mean, ",\n  ");
    fprintf(f, "\"low\": %llu, \"low30\": %llu, ", (unsigned long long)below(q, 7),
            (unsigned long long)below(q, 6));
    tool_json_value(f, "sicn_min", q->sicn_min, ", ");
    tool_json_value(f, "dih_min", q->dihedral_min_degrees, ", ");
    tool_json_value(f, "dih_max", q->dihedral_max_degrees, ",\n  ");
    tool_json_counts(f, "gamma_histogram", q->histogram, 20);
    fprintf(f, ",\n  ");
    tool_json_counts(f, "dihedral_histogram", q->dihedral_histogram, 18);
    fprintf(f, ",\n");
}

/* Writes the kept regions. */
static void json_regions(FILE *f, const job *j)
{
    uint32_t i;
    int any = 0;
    fprintf(f, "  \"regions\": [");
    for (i = 0; i < j->domain.num_regions; i++) {
        const mesher_region *r = &j->domain.regions[i];
        if (!r->kept) continue;
        fprintf(f, "%s{\"number\": %ld, \"volume\": %.9g, \"depth\": %lu, \"winding\": %d}",
                any++ ? ", " : "", (long)(int32_t)r->number, r->volume, (unsigned long)r->depth,
                r->winding);
    }
    fprintf(f, "],\n");
}

/* Writes how many tetrahedra are left below the target, by reason. */
static void json_left(FILE *f, const spr_report *r)
{
    fprintf(f,
            "  \"left\": {\"surface\": %llu, \"fixed\": %llu, \"stuck\": %llu, "
            "\"untried\": %llu},\n",
            (unsigned long long)r->bounded, (unsigned long long)r->fixed,
            (unsigned long long)r->stuck, (unsigned long long)r->unfinished);
}

/* Writes the numbers of an array that lie in [low, high), less low. */
static void json_ids(FILE *f, const char *name, const uint32_t *ids, int n, size_t low, size_t high)
{
    int i, any = 0;
    fprintf(f, ", \"%s\": [", name);
    for (i = 0; i < n; i++)
        if (ids[i] != DELAUNAY_NO_ID && ids[i] >= low && ids[i] < high)
            fprintf(f, "%s%llu", any++ ? ", " : "", (unsigned long long)(ids[i] - low));
    fprintf(f, "]");
}

static int is_about_seeds(mesher_kind kind)
{
    return kind == MESHER_NOTE_OUTSIDE_SEED || kind == MESHER_NOTE_SHARED_CELL;
}

/* Writes every finding that was kept, defects first, with its ids and its place. */
static void json_findings(FILE *f, const job *j)
{
    const size_t n = (size_t)j->report.input_triangles,
                 lines = n == j->in.num_triangles ? num_in_file(j) : n;
    size_t i;
    int k;
    fprintf(f, "  \"places\": [");
    for (i = 0; i < j->report.num_findings; i++) {
        const mesher_finding found = finding_in_file(j, &j->report.findings[i]), *w = &found;
        fprintf(f, "%s\n    {\"kind\": \"", i ? "," : "");
        tool_json_text(f, mesher_kind_string(w->kind));
        fprintf(f, "\", \"defect\": %s", mesher_is_defect(w->kind) ? "true" : "false");
        json_ids(f, "triangles", w->triangles, 2, 0, lines);
        json_ids(f, "lines", w->triangles, 2, lines, DELAUNAY_NO_ID);
        json_ids(f, is_about_seeds(w->kind) ? "seeds" : "vertices", w->vertices, 3, 0,
                 DELAUNAY_NO_ID);
        fprintf(f, ", \"xyz\": [");
        for (k = 0; k < 3; k++)
            if (w->xyz[k] - w->xyz[k] == 0) fprintf(f, "%s%.17g", k ? ", " : "", w->xyz[k]);
            else fprintf(f, "%snull", k ? ", " : "");
        fprintf(f, "]}");
    }
    fprintf(f, "],\n");
}

static void json_body(FILE *f, const job *j, int code)
{
    int k, any = 0;
    fprintf(f, "{\n  \"input\": \"");
    tool_json_text(f, j->name);
    fprintf(f, "\", \"exit_code\": %d, \"message\": \"", code);
    tool_json_text(f, j->message);
    fprintf(f, "\",\n  \"input_vertices\": %llu, \"input_triangles\": %llu,\n  \"findings\": {",
            (unsigned long long)j->in.num_vertices, (unsigned long long)num_in_file(j));
    for (k = 0; k < MESHER_NUM_KINDS; k++) {
        if (!j->report.counts[k]) continue;
        fprintf(f, "%s\"", any++ ? ", " : "");
        tool_json_text(f, mesher_kind_string((mesher_kind)k));
        fprintf(f, "\": %llu", (unsigned long long)j->report.counts[k]);
    }
    fprintf(f, "}, \"all_counted\": %s,\n", mesher_counts_all(&j->report) ? "true" : "false");
    json_findings(f, j);
    fprintf(f,
            "  \"cut_triangles\": %llu, \"collinear_left_out\": %llu,\n"
            "  \"welded_vertices\": %llu, \"weld_that_cures\": %.2g, \"triangles_it_drops\": %llu, "
            "\"nodes_left_out\": %llu,",
            (unsigned long long)j->num_cut, (unsigned long long)j->num_collinear,
            (unsigned long long)j->num_welded,
            j->cure.state == CURE_FOUND ? j->cure.distance : 0,
            (unsigned long long)(j->cure.state == CURE_FOUND ? j->cure.num_gone : 0),
            (unsigned long long)j->in.num_spare);
    fprintf(f, "\n  \"surface_vertices\": %llu, \"surface_triangles\": %llu,",
            (unsigned long long)j->surface.num_vertices,
            (unsigned long long)j->surface.num_triangles);
    fprintf(f, "\n  \"vertices\": %llu, \"tets\": %llu, \"cells\": %llu,\n",
            (unsigned long long)j->out.num_vertices, (unsigned long long)j->out.num_tets,
            (unsigned long long)j->report.num_regions);
    fprintf(f,
            "  \"interior_steiner\": %llu, \"surface_steiner\": %llu, \"missing_edges\": %llu, "
            "\"missing_facets\": %llu,\n",
            (unsigned long long)j->report.interior_steiner,
            (unsigned long long)j->report.surface_steiner,
            (unsigned long long)j->report.missing_edges,
            (unsigned long long)j->report.missing_facets);
    fprintf(
        f,
        "  \"refined_vertices\": %llu, \"size_p10\": %.4g, \"size_p50\": %.4g, \"size_p90\": %.4g, "
        "\"size_in_band\": %.4g,\n",
        (unsigned long long)j->report.refined_vertices, j->report.size_p10, j->report.size_p50,
        j->report.size_p90, j->report.size_in_band);
    if (j->out.num_tets) {
        json_regions(f, j);
        json_quality(f, &j->quality);
        if (!j->set.no_improve) json_left(f, &j->spr);
    }
    fprintf(f, "  \"threads\": %d, \"peak_bytes\": %.0f,\n  \"seconds\": {",
            delaunay_threads(&j->set.mesher.host), tool_peak_bytes());
    for (k = 0; k < NUM_PHASES; k++) fprintf(f, "\"%s\": %.6f, ", phase_names[k], j->seconds[k]);
    fprintf(f, "\"total\": %.6f}\n}\n", total_seconds(j, 1));
}

/* Writes the file of --json and closes it, also after a failure, which the file then describes.
 * Returns the exit code. */
static int write_json(const job *j, FILE *f, int code)
{
    int failed;
    json_body(f, j, code);
    failed = ferror(f);
    if (fclose(f) != 0) failed = 1;
    if (!failed) return code;
    fprintf(stderr, "mesh: cannot write '%s': %s\n", j->set.json, strerror(errno));
    return TOOL_CANNOT_WRITE;
}

/* ---- the whole run ---- */

/* Checks the result against --max-tets and --max-vertices: the budgets end refinement, but the
 * surface alone may need more. */
static void check_budgets(job *j)
{
    const mesher_options *o = &j->set.mesher;
    const char *what = NULL;
    if (o->max_vertices && j->out.num_vertices > o->max_vertices)
        what = "more vertices than --max-vertices";
    if (o->max_tets && j->out.num_tets > o->max_tets) what = "more tetrahedra than --max-tets";
    if (!what || j->code != TOOL_OK) return;
    j->code = complain(j, what, TOOL_GOAL_NOT_MET);
}

static int run(job *j)
{
    int code = read_input(j);
    if (code == TOOL_OK) code = weld(j);
    if (code == TOOL_OK) code = split_edges(j);
    if (code != TOOL_OK) return code;
    if (!set_surface(j)) return complain(j, "out of memory", TOOL_NO_MEMORY);
    if (j->set.check) return check_surface(j);
    code = read_grid(j);
    if (code == TOOL_OK) code = read_size_mesh(j);
    if (code != TOOL_OK) return code;
    if (!tool_can_create("mesh", j->set.output)) {
        snprintf(j->message, sizeof j->message, "OUTPUT cannot be created");
        return TOOL_CANNOT_WRITE;
    }
    if (!tool_can_create("mesh", j->set.save_sizes)) {
        snprintf(j->message, sizeof j->message, "the file of --save-sizes cannot be created");
        return TOOL_CANNOT_WRITE;
    }
    if (changes_surface(&j->set)) code = change_surface(j);
    if (code == TOOL_OK) code = mesh_surface(j);
    if (code != TOOL_OK) return code;
    if (mesher_export(&j->domain, &j->out) != MESHER_OK)
        return complain(j, "out of memory", TOOL_NO_MEMORY);
    if (j->set.mesher.drop_outside) drop_outside(j);
    if (j->set.mesher.drop_unused && !drop_unused(j))
        return complain(j, "out of memory", TOOL_NO_MEMORY);
    check_budgets(j);
    if (j->set.output) {
        code = write_output(j);
        if (code != TOOL_OK) return code;
    }
    code = save_sizes(j);
    if (code != TOOL_OK) return code;
    if (!j->set.quiet) print_statistics(j);
    return j->code;
}

int main(int argc, char **argv)
{
    static job the_job;
    job *j = &the_job;
    FILE *json = NULL;
    int code = parse(argc, argv, &j->set);
    if (code) return tool_end("mesh", code == 1 ? TOOL_OK : TOOL_USAGE);
    if (!tool_is_exact("mesh")) return TOOL_INTERNAL;
    if (j->set.json && !(json = fopen(j->set.json, "w"))) {
        fprintf(stderr, "mesh: cannot create '%s': %s\n", j->set.json, strerror(errno));
        return TOOL_CANNOT_WRITE;
    }
    if (!tool_clears_output("mesh", "--json", j->set.json, j->set.output,
                            output_format(&j->set) == MESHIO_FORMAT_ELE)) { /* now it exists */
        fclose(json);
        remove(j->set.json);
        return TOOL_USAGE;
    }
    if (tool_is_stdout(j->set.output) || tool_is_stdout(j->set.json)) j->set.quiet = 1;
    return_large_blocks();
    tool_catch_signals();
    j->name = "";
    j->start = tool_seconds();
    j->set.progress = !j->set.quiet && tool_is_terminal(stderr);
    j->set.mesher.host.progress = on_progress;
    j->set.mesher.host.log = on_log;
    j->set.mesher.host.user = j;
    j->set.spr.host = j->set.mesher.host;
    code = run(j);
    if (json) code = write_json(j, json, code);
    mesher_output_free(&j->domain, &j->out);
    mesher_domain_free(&j->domain);
    mesher_fine_surface_free(&j->fine);
    free(j->second.xyz);
    free(j->second.tets);
    free(j->second.triangles);
    free(j->second.edges);
    free(j->report.findings);
    free(j->notes.findings);
    free(j->cut_from);
    free(j->seeds);
    free(j->grid_sizes);
    mesher_size_mesh_free(&j->size_mesh);
    mesher_size_mesh_free(&j->kept_sizes);
    free(j->kept_xyz);
    free(j->kept_tets);
    free(j->mesh_sizes);
    meshio_free(&j->background);
    free(j->seed_tags);
    meshio_free(&j->in);
    return tool_end("mesh", code);
}
