/* improve.c - improves the worst tetrahedra of any tetrahedral mesh; surface and interfaces stay
 *
 *   cc -O3 -fopenmp examples/improve.c -o improve -lm
 *   improve in.msh -o out.vtu
 */
#if defined(__STRICT_ANSI__) && !defined(_XOPEN_SOURCE)
#  define _XOPEN_SOURCE 700 /* with -std=c99 too, files and clocks are those of POSIX */
#endif
#define SPR_IMPLEMENTATION
#include "../spr.h"
#define MESHIO_IMPLEMENTATION
#include "meshio.h"
#include "tool.h"

static const char help[] =
    "usage: improve INPUT [-o OUTPUT] [options]\n"
    "\n"
    "Improves a tetrahedral mesh (.mesh .meshb .msh .vtk .vtu .inp .ele) by smoothing, edge removal\n"
    "and reconnection of small polyhedra. Facets on the boundary and between regions stay as they\n"
    "are, and so do the lines and triangles of the file (unless its triangles are the facets of all\n"
    "tetrahedra). The worst quality never falls, there are no more bad tetrahedra than before (but\n"
    "for a few where some of the worst become better), and none is ever inverted. Without -o only the\n"
    "statistics are printed. Of elements of higher order only the corners are kept.\n"
    "\n"
    "  -o, --output FILE    .mesh .meshb .msh .msh4 .vtu .vtk .inp .ele\n"
    "  --measure M          gamma (default), sicn, dihedral (the sine of the smallest dihedral angle)\n"
    "  --target Q           0 .. 1: tetrahedra below are bad; default 0.35, and when none is left,\n"
    "                       the worst few. If it is given and one is left, the exit code is 1\n"
    "  --keep-vertices      add no vertex and take none away\n"
    "  --no-smoothing       do not move vertices\n"
    "  --effort E           0.01 to 100, default 1: how long to try where bad ones are left; more\n"
    "                       mostly leaves fewer\n"
    "  --max-seconds S      stop after about S seconds\n"
    "  --threads N          default: what OpenMP chooses\n"
    "  --bad FILE           list the bad tetrahedra that are left, as CSV: middle, measure, the best\n"
    "                       that their facets on the surface allow, and why they are left\n"
    "  --histogram          of the measure and of the dihedral angles, before and after\n"
    "  --json FILE          write the statistics before and after in a form for programs; - is where\n"
    "                       the program prints\n"
    "  -q, --quiet          print nothing but errors\n"
    "  --help, --version\n"
    "\n"
    "exit codes: 0 ok, 1 target or budget not met or interrupted (the mesh is written, as good as it\n"
    "is by then), 2 usage, 3 cannot read, 4 cannot write, 5 not a valid mesh, 7 memory, 70 internal\n"
    "error\n";

typedef struct arguments {
    const char *input, *output, *bad, *json;
    spr_options options;
    int quiet, histogram;
} arguments;

static int parse_measure(const char *name, spr_measure *measure)
{
    if (!name) return 0;
    if (strcmp(name, "gamma") == 0) *measure = SPR_GAMMA;
    else if (strcmp(name, "sicn") == 0) *measure = SPR_SICN;
    else if (strcmp(name, "dihedral") == 0) *measure = SPR_MIN_DIHEDRAL;
    else return 0;
    return 1;
}

/* Whether the arguments go together; if not, says why. */
static int arguments_fit(const arguments *args)
{
    int is_ele;
    if (!args->input) {
        fprintf(stderr, "improve: no mesh; try --help\n");
        return 0;
    }
    is_ele = args->output && meshio_format_of(args->output) == MESHIO_FORMAT_ELE;
    if (!tool_spares("improve", "--bad", args->bad, args->input) ||
        !tool_clears_output("improve", "--bad", args->bad, args->output, is_ele) ||
        !tool_spares("improve", "--json", args->json, args->input) ||
        !tool_clears_output("improve", "--json", args->json, args->output, is_ele) ||
        !tool_is_apart("improve", "--json", args->json, args->bad))
        return 0;
    if (args->output && !meshio_holds_tetrahedra(meshio_format_of(args->output))) {
        fprintf(stderr, "improve: no tetrahedra can be written to '%s'; try .mesh, .msh or .vtu\n",
                args->output);
        return 0;
    }
    return 1;
}

/* What the options with a value need. */
static const tool_need needs[] = {{"-o", "the name of a file", 0, 0},
                                  {"--output", "the name of a file", 0, 0},
                                  {"--measure", "gamma, sicn or dihedral", 0, 0},
                                  {"--target", "a number from 1e-9 to 1", 1e-9, 1},
                                  {"--effort", "a number from 0.01 to 100", 0.01, 100},
                                  {"--max-seconds", "a number from 0.001 to 1e9", 0.001, 1e9},
                                  {"--threads", "a number from 1 to 4096", 1, 4096},
                                  {"--bad", "the name of a file", 0, 0},
                                  {"--json", "the name of a file", 0, 0},
                                  {NULL, NULL, 0, 0}};

/* Takes an option with a number. */
static int parse_number(const char *a, const char *text, spr_options *options)
{
    double v;
    if (!tool_needed_number(needs, a, text, &v)) return 0;
    if (strcmp(a, "--target") == 0) {
        options->target = v;
        options->require_target = 1;
    } else if (strcmp(a, "--effort") == 0) options->effort = v;
    else if (strcmp(a, "--max-seconds") == 0) options->max_seconds = v;
    else options->host.num_threads = (int)v; /* --threads */
    return 1;
}

/* Returns 0: go on; 1: done (--help, --version); 2: wrong usage. */
static int parse(int argc, char **argv, arguments *args)
{
    int i;
    for (i = 1; i < argc; i++) {
        const char *a = argv[i];
        if (strcmp(a, "--help") == 0 || strcmp(a, "-h") == 0) {
            fputs(help, stdout);
            return 1;
        } else if (strcmp(a, "--version") == 0) {
            printf("improve %d.%d.%d\n", SPR_VERSION / 10000, SPR_VERSION / 100 % 100,
                   SPR_VERSION % 100);
            return 1;
        } else if ((strcmp(a, "-o") == 0 || strcmp(a, "--output") == 0) && i + 1 < argc) {
            args->output = tool_output_name(argv[++i]);
        } else if (strcmp(a, "--measure") == 0 &&
                   parse_measure(argv[i + 1], &args->options.measure)) {
            i++;
        } else if (parse_number(a, argv[i + 1], &args->options)) {
            i++;
        } else if (strcmp(a, "--keep-vertices") == 0) {
            args->options.keep_vertices = 1;
        } else if (strcmp(a, "--bad") == 0 && i + 1 < argc) {
            args->bad = tool_output_name(argv[++i]);
        } else if (strcmp(a, "--json") == 0 && i + 1 < argc) {
            args->json = tool_output_name(argv[++i]);
        } else if (strcmp(a, "--histogram") == 0) {
            args->histogram = 1;
        } else if (strcmp(a, "--no-smoothing") == 0) {
            args->options.no_smoothing = 1;
        } else if (strcmp(a, "-q") == 0 || strcmp(a, "--quiet") == 0) {
            args->quiet = 1;
        } else if (a[0] == '-' || args->input) {
            tool_complain("improve", needs, a, argv[i + 1]);
            return 2;
        } else {
            args->input = a;
        }
    }
    return arguments_fit(args) ? 0 : 2;
}

static int exit_code(spr_result result)
{
    switch (result) {
    case SPR_OK: return TOOL_OK;
    case SPR_STOPPED_BY_BUDGET:
    case SPR_GOAL_NOT_MET:
    case SPR_CANCELLED: return TOOL_GOAL_NOT_MET;
    case SPR_ERROR_OUT_OF_MEMORY:
    case SPR_ERROR_TOO_LARGE: return TOOL_NO_MEMORY;
    case SPR_ERROR_INVALID_MESH: return TOOL_BAD_SURFACE;
    case SPR_ERROR_INVALID_ARGUMENT: return TOOL_USAGE;
    default: return TOOL_INTERNAL;
    }
}

static void print_row(const char *name, const spr_statistics *s)
{
    printf("%-8s %12llu %9.4f %9.4f %9.4f %9.4f %10llu %8.2f %8.2f\n", name,
           (unsigned long long)s->num_tets, s->min, s->p001, s->p01, s->mean,
           (unsigned long long)s->num_below, s->dihedral_min_degrees, s->dihedral_max_degrees);
}

static void print_statistics(const spr_report *report)
{
    printf("%-8s %12s %9s %9s %9s %9s %10s %8s %8s\n", "", "tetrahedra", "min", "0.1 %", "1 %",
           "mean", "bad", "angle >=", "angle <=");
    print_row("before", &report->before);
    print_row("after", &report->after);
    printf("smoothed %llu, edges removed %llu, reconnected %llu, vertices -%llu +%llu, "
           "shaken %llu\n",
           (unsigned long long)report->smoothed, (unsigned long long)report->edges_removed,
           (unsigned long long)report->reconnected, (unsigned long long)report->vertices_removed,
           (unsigned long long)report->vertices_inserted, (unsigned long long)report->shaken);
    printf("seconds %.3f: smoothing %.3f, edge removal %.3f, reconnection %.3f\n", report->seconds,
           report->seconds_smoothing, report->seconds_edge_removal, report->seconds_reconnection);
}

static const char *const reason[] = {"held by the surface", "all vertices fixed", "nothing helps",
                                     "not everything was tried"};

/* Writes a bad tetrahedron that is left to the file of --bad. */
static void list_bad(void *user, const spr_worst *w)
{
    fprintf((FILE *)user, "%.17g,%.17g,%.17g,%.6g,%.6g,%s\n", w->xyz[0], w->xyz[1], w->xyz[2],
            w->quality, w->bound, reason[w->reason]);
}

/* Prints how many bad tetrahedra are left for which reason, and the worst of them. */
static void print_worst(const spr_report *r)
{
    int i;
    if (r->after.num_below == 0) return;
    printf("bad ones left: %llu held by the surface, %llu with all vertices fixed,\n"
           "%llu that nothing helps, %llu for which not everything was tried; the worst:\n",
           (unsigned long long)r->bounded, (unsigned long long)r->fixed,
           (unsigned long long)r->stuck, (unsigned long long)r->unfinished);
    for (i = 0; i < r->num_worst; i++) {
        const spr_worst *w = &r->worst[i];
        printf("  %.4g at (%.6g, %.6g, %.6g): %s", w->quality, w->xyz[0], w->xyz[1], w->xyz[2],
               reason[w->reason]);
        if (w->reason == SPR_BOUNDED) printf(", at most %.4g", w->bound);
        printf("\n");
    }
}

static void print_counts(const char *what, double step, const uint64_t *before,
                         const uint64_t *after, int n)
{
    int i;
    printf("%-14s %12s %12s\n", what, "before", "after");
    for (i = 0; i < n; i++)
        printf("%6.6g - %-5.4g %12llu %12llu\n", step * i, step * (i + 1),
               (unsigned long long)before[i], (unsigned long long)after[i]);
}

static void print_histograms(const spr_report *r)
{
    print_counts("measure", 0.05, r->before.histogram, r->after.histogram, 20);
    print_counts("degrees", 10, r->before.dihedral_histogram, r->after.dihedral_histogram, 18);
}

static void json_statistics(FILE *f, const char *when, const spr_statistics *s)
{
    fprintf(f, "  \"%s\": {\"tets\": %llu, ", when, (unsigned long long)s->num_tets);
    tool_json_value(f, "min", s->min, ", ");
    tool_json_value(f, "p001", s->p001, ", ");
    tool_json_value(f, "p01", s->p01, ", ");
    tool_json_value(f, "mean", s->mean, ", ");
    fprintf(f, "\"low\": %llu,\n    ", (unsigned long long)s->num_below);
    tool_json_value(f, "sicn_min", s->sicn_min, ", ");
    tool_json_value(f, "dih_min", s->dihedral_min_degrees, ", ");
    tool_json_value(f, "dih_max", s->dihedral_max_degrees, ",\n    ");
    tool_json_counts(f, "histogram", s->histogram, 20);
    fprintf(f, ",\n    ");
    tool_json_counts(f, "dihedral_histogram", s->dihedral_histogram, 18);
    fprintf(f, "},\n");
}

/* Writes what goes into the file of --json: the exit code, also of a failure, and the report. */
static void write_json(FILE *f, const arguments *args, const spr_report *r, int code)
{
    static const char *const measures[] = {"gamma", "sicn", "dihedral"};
    int i;
    fprintf(f, "{\n  \"input\": \"");
    tool_json_text(f, args->input);
    fprintf(f, "\", \"exit_code\": %d, \"message\": \"", code);
    tool_json_text(f, r->message);
    fprintf(f, "\",\n  \"measure\": \"%s\",\n", measures[args->options.measure]);
    json_statistics(f, "before", &r->before);
    json_statistics(f, "after", &r->after);
    fprintf(f,
            "  \"left\": {\"surface\": %llu, \"fixed\": %llu, \"stuck\": %llu, "
            "\"untried\": %llu},\n  \"worst\": [",
            (unsigned long long)r->bounded, (unsigned long long)r->fixed,
            (unsigned long long)r->stuck, (unsigned long long)r->unfinished);
    for (i = 0; i < r->num_worst; i++) {
        const spr_worst *w = &r->worst[i];
        fprintf(f, "%s\n    {", i ? "," : "");
        tool_json_value(f, "value", w->quality, ", ");
        tool_json_value(f, "bound", w->bound, ", ");
        fprintf(f, "\"reason\": \"%s\", \"xyz\": [%.17g, %.17g, %.17g]}", reason[w->reason],
                w->xyz[0], w->xyz[1], w->xyz[2]);
    }
    fprintf(f, "],\n  \"seconds\": %.6f\n}\n", r->seconds);
}

/* Says what is wrong, also for the file of --json. Returns the exit code. */
static int complain(const arguments *args, spr_report *report, const char *text, int code)
{
    fprintf(stderr, "improve: %s: %s\n", args->input, text);
    snprintf(report->message, sizeof report->message, "%.255s", text);
    return code;
}

/* Enlarges the arrays for what the improvement may add. Returns 0 if memory runs out. */
static int make_room(meshio_mesh *m, size_t cap_vertices, size_t cap_tets)
{
    void *xyz = realloc(m->xyz, cap_vertices * 3 * sizeof(double));
    void *tags, *tets, *colors;
    if (xyz) m->xyz = (double *)xyz;
    tags = realloc(m->vertex_tags, cap_vertices * sizeof(int32_t));
    if (tags) m->vertex_tags = (int32_t *)tags;
    tets = realloc(m->tets, cap_tets * 4 * sizeof(uint32_t));
    if (tets) m->tets = (uint32_t *)tets;
    colors = realloc(m->tet_tags, cap_tets * sizeof(int32_t));
    if (colors) m->tet_tags = (int32_t *)colors;
    return xyz && tags && tets && colors;
}

typedef struct facet {
    uint32_t v[3]; /* ascending */
} facet;

static facet facet_of(uint32_t a, uint32_t b, uint32_t c)
{
    facet f;
    f.v[0] = a;
    f.v[1] = b;
    f.v[2] = c;
    tool_ascend(f.v);
    return f;
}

static int compare_facets(const void *p, const void *q)
{
    const facet *a = (const facet *)p, *b = (const facet *)q;
    int i;
    for (i = 0; i < 2 && a->v[i] == b->v[i]; i++) {}
    return a->v[i] < b->v[i] ? -1 : a->v[i] > b->v[i];
}

/* The facets of all tetrahedra, sorted, each once; *num: how many. NULL: memory ran out. */
static facet *facets_of(const meshio_mesh *m, size_t *num)
{
    facet *all = (facet *)malloc((4 * m->num_tets + 1) * sizeof *all);
    size_t i, n = 0;
    *num = 0;
    if (!all) return NULL;
    for (i = 0; i < 4 * m->num_tets; i++) {
        const uint32_t *v = m->tets + i / 4 * 4;
        const uint8_t *o = delaunay_facet_order((int)(i % 4));
        all[i] = facet_of(v[o[0]], v[o[1]], v[o[2]]);
    }
    qsort(all, 4 * m->num_tets, sizeof *all, compare_facets);
    for (i = 0; i < 4 * m->num_tets; i++)
        if (n == 0 || compare_facets(&all[n - 1], &all[i]) != 0) all[n++] = all[i];
    *num = n;
    return all;
}

/* The number of triangle i in a sorted list of facets, plus 1; 0: it is none. */
static size_t facet_number(const meshio_mesh *m, size_t i, const facet *all, size_t num)
{
    const uint32_t *v = m->triangles + 3 * i;
    const facet f = facet_of(v[0], v[1], v[2]),
                *found = (const facet *)bsearch(&f, all, num, sizeof *all, compare_facets);
    return found ? (size_t)(found - all) + 1 : 0;
}

/* Whether the file lists the facets of all tetrahedra, as TetGen's -g does. If so, the triangles do
 * not ask for facets to be kept; *inner then tells which of them are facets. -1: memory ran out. */
static int lists_all_facets(const meshio_mesh *m, uint8_t **inner)
{
    facet *all;
    uint8_t *listed;
    size_t num, i, n, left = 0;
    int enough;
    *inner = NULL;
    if (m->num_triangles / 2 < m->num_tets) return 0; /* there are two for each, and more */
    all = facets_of(m, &num);
    listed = (uint8_t *)calloc(num + 1, 1);
    *inner = (uint8_t *)calloc(m->num_triangles + 1, 1);
    enough = all && listed && *inner;
    for (i = 0; enough && i < m->num_triangles; i++) {
        n = facet_number(m, i, all, num);
        (*inner)[i] = n > 0;
        if (n) listed[n - 1] = 1;
    }
    for (i = 0; enough && i < num; i++) left += !listed[i];
    free(all);
    free(listed);
    return enough ? left == 0 : -1;
}

/* Drops the triangles that were facets of tetrahedra, and are none any more. Returns 0 if memory
 * runs out. */
static int drop_triangles(meshio_mesh *m, const uint8_t *inner)
{
    size_t num, i, n = 0;
    facet *all = facets_of(m, &num);
    if (!all) return 0;
    for (i = 0; i < m->num_triangles; i++) {
        if (inner[i] && !facet_number(m, i, all, num)) continue;
        memmove(m->triangles + 3 * n, m->triangles + 3 * i, 3 * sizeof *m->triangles);
        m->triangle_tags[n++] = m->triangle_tags[i];
    }
    m->num_triangles = n;
    free(all);
    return 1;
}

/* Swaps region numbers -1 and spare. The regions of a file may be any 32-bit numbers, but spr.h
 * does not accept -1 (UINT32_MAX): a spare number takes its place. */
static void swap_regions(meshio_mesh *m, int32_t spare)
{
    size_t i;
    for (i = 0; i < m->num_tets; i++)
        if (m->tet_tags[i] == -1) m->tet_tags[i] = spare;
        else if (m->tet_tags[i] == spare) m->tet_tags[i] = -1;
}

/* Opens the file of --bad or --json. Returns NULL, and says so, if it cannot be written. */
static FILE *open_file(const char *name)
{
    FILE *f = fopen(name, "w");
    if (!f) fprintf(stderr, "improve: cannot write '%s': %s\n", name, strerror(errno));
    return f;
}

/* Closes it. Returns 0, and says so, if something of it was lost. */
static int close_file(FILE *f, const char *name)
{
    int lost = ferror(f);
    if (fclose(f) != 0) lost = 1;
    if (lost) fprintf(stderr, "improve: cannot write '%s'\n", name);
    return !lost;
}

/* Improves a mesh whose arrays have room for this many vertices and tetrahedra. */
static spr_result improve_arrays(meshio_mesh *m, size_t cap_vertices, size_t cap_tets,
                                 const spr_options *options, spr_report *report)
{
    const int32_t spare = tool_unused_tag(m->tet_tags, m->num_tets);
    size_t v = m->num_vertices;
    spr_result result;
    swap_regions(m, spare);
    result =
        spr_improve_arrays(m->xyz, &m->num_vertices, cap_vertices, m->tets, (uint32_t *)m->tet_tags,
                           &m->num_tets, cap_tets, NULL, options, report);
    swap_regions(m, spare);
    for (; v < m->num_vertices; v++) m->vertex_tags[v] = 0;
    return result;
}

/* Leaves out the nodes at no corner of an element, that is, those in the middle of elements of a
 * higher order and those saved as points of no group. Returns 0 if memory runs out. */
static int drop_spare(const arguments *args, meshio_mesh *m)
{
    uint32_t *number, next = 0;
    size_t v;
    if (m->num_spare == 0) return 1;
    number = (uint32_t *)malloc(m->num_vertices * sizeof *number);
    if (!number) return 0;
    for (v = 0; v < m->num_vertices; v++) {
        number[v] = next;
        if (m->spare[v]) continue;
        memmove(m->xyz + 3 * (size_t)next, m->xyz + 3 * v, 3 * sizeof *m->xyz);
        m->vertex_tags[next++] = m->vertex_tags[v];
    }
    m->num_vertices = next;
    tool_renumber(m->tets, 4 * (uint64_t)m->num_tets, number);
    tool_renumber(m->triangles, 3 * (uint64_t)m->num_triangles, number);
    tool_renumber(m->edges, 2 * (uint64_t)m->num_edges, number);
    free(number);
    fprintf(stderr,
            "improve: %s: %llu nodes in the middle of elements, or saved as points of no group, "
            "are left out: the elements become those of first order\n",
            args->input, (unsigned long long)m->num_spare);
    return 1;
}

/* Reads the mesh. */
static int read_mesh(const arguments *args, meshio_mesh *m, spr_report *report)
{
    meshio_report io;
    char text[200];
    const meshio_result result = meshio_read(args->input, MESHIO_FORMAT_AUTO, m, &io);
    if (result != MESHIO_OK)
        return complain(args, report, io.message,
                        result == MESHIO_ERROR_OUT_OF_MEMORY ? TOOL_NO_MEMORY : TOOL_CANNOT_READ);
    if (m->num_tets == 0)
        return complain(args, report, "no tetrahedra in this file", TOOL_BAD_SURFACE);
    if (m->num_solids == 0)
        return drop_spare(args, m) ? TOOL_OK
                                   : complain(args, report, "out of memory", TOOL_NO_MEMORY);
    snprintf(text, sizeof text,
             "%llu hexahedra, prisms, pyramids or the like are not read, and would be lost",
             (unsigned long long)m->num_solids);
    return complain(args, report, text, TOOL_CANNOT_READ);
}

/* Writes the improved mesh. inner: which triangles are facets, if the file has listed the facets of
 * all tetrahedra; else NULL. */
static int write_mesh(const arguments *args, meshio_mesh *m, const uint8_t *inner,
                      spr_report *report)
{
    meshio_report io;
    if (inner) {
        fprintf(stderr, "improve: %s lists the facets of all tetrahedra; inner ones do not stay\n",
                args->input);
        if (!drop_triangles(m, inner))
            return complain(args, report, "out of memory", TOOL_NO_MEMORY);
    }
    if (!args->output || meshio_write(args->output, m, NULL, &io) == MESHIO_OK) return TOOL_OK;
    return complain(args, report, io.message, TOOL_CANNOT_WRITE);
}

/* Improves the mesh that has been read, and writes it. inner: see write_mesh. */
static int improve_and_write(const arguments *args, meshio_mesh *m, const uint8_t *inner,
                             spr_report *report)
{
    const size_t cap_vertices = m->num_vertices + m->num_vertices / 4 + 1000;
    const size_t cap_tets = 2 * m->num_tets + 10000;
    spr_options options = args->options;
    FILE *bad = NULL;
    spr_result result;
    int code, written;
    if (!tool_can_create("improve", args->output)) {
        snprintf(report->message, sizeof report->message, "OUTPUT cannot be created");
        return TOOL_CANNOT_WRITE;
    }
    if (!make_room(m, cap_vertices, cap_tets))
        return complain(args, report, "out of memory", TOOL_NO_MEMORY);
    if (args->bad) {
        bad = open_file(args->bad);
        if (!bad) {
            snprintf(report->message, sizeof report->message, "cannot write the file of --bad");
            return TOOL_CANNOT_WRITE;
        }
        fputs("x,y,z,measure,bound,reason\n", bad);
        options.left = list_bad;
        options.left_user = bad;
    }
    options.kept_triangles = m->triangles;
    options.num_kept_triangles = inner ? 0 : m->num_triangles;
    options.kept_edges = m->edges;
    options.num_kept_edges = m->num_edges;
    result = improve_arrays(m, cap_vertices, cap_tets, &options, report);
    code = exit_code(result);
    if (bad && !close_file(bad, args->bad)) return TOOL_CANNOT_WRITE;
    if (code != TOOL_OK)
        fprintf(stderr, "improve: %s: %s\n", args->input,
                report->message[0] ? report->message : spr_result_string(result));
    if (code != TOOL_OK && code != TOOL_GOAL_NOT_MET) return code;
    if (report->absent)
        fprintf(stderr,
                "improve: %s: %llu triangles and lines are no facets and edges of tetrahedra\n",
                args->input, (unsigned long long)report->absent);
    written = write_mesh(args, m, inner, report);
    if (written != TOOL_OK) return written;
    if (!args->quiet && !tool_is_stdout(args->output) && !tool_is_stdout(args->bad) &&
        !tool_is_stdout(args->json)) {
        print_statistics(report);
        print_worst(report);
        if (args->histogram) print_histograms(report);
    }
    return code;
}

static int improve_mesh(const arguments *args, meshio_mesh *m, spr_report *report)
{
    uint8_t *inner;
    const int all = lists_all_facets(m, &inner);
    const int code = all < 0 ? complain(args, report, "out of memory", TOOL_NO_MEMORY)
                             : improve_and_write(args, m, all ? inner : NULL, report);
    free(inner);
    return code;
}

/* Does everything, and writes the file of --json, if any, which is opened before. */
static int improve(const arguments *args)
{
    FILE *json = args->json ? open_file(args->json) : NULL;
    meshio_mesh mesh;
    spr_report report;
    int code;
    if (args->json && !json) return TOOL_CANNOT_WRITE;
    memset(&mesh, 0, sizeof mesh);
    memset(&report, 0, sizeof report);
    code = read_mesh(args, &mesh, &report);
    if (code == TOOL_OK) code = improve_mesh(args, &mesh, &report);
    meshio_free(&mesh);
    if (!json) return code;
    write_json(json, args, &report, code);
    return close_file(json, args->json) ? code : TOOL_CANNOT_WRITE;
}

int main(int argc, char **argv)
{
    arguments args;
    int code;
    memset(&args, 0, sizeof args);
    code = parse(argc, argv, &args);
    if (code) return tool_end("improve", code == 1 ? TOOL_OK : TOOL_USAGE);
    if (!tool_is_exact("improve")) return TOOL_INTERNAL;
    tool_catch_signals();
    args.options.host.progress = tool_progress;
    return tool_end("improve", improve(&args));
}
