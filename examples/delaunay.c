/* delaunay.c - the Delaunay triangulation of a file of points
 *
 *   cc -O3 -fopenmp examples/delaunay.c -o delaunay -lm
 *   delaunay points.xyz -o tets.mesh
 */
#if defined(__STRICT_ANSI__) && !defined(_XOPEN_SOURCE)
#  define _XOPEN_SOURCE 700 /* with -std=c99 too, files and clocks are those of POSIX */
#endif
#define DELAUNAY_IMPLEMENTATION
#include "../delaunay.h"
#define MESHIO_IMPLEMENTATION
#include "meshio.h"
#include "tool.h"

static const char help[] =
    "usage: delaunay POINTS [-o OUTPUT] [options]\n"
    "\n"
    "Triangulates the points of a file: .xyz (text, three numbers a line), .bin (raw little-endian\n"
    "doubles), TetGen .node, or the vertices of any mesh file. OUTPUT (.mesh .meshb .msh .msh4 .vtu\n"
    ".vtk .inp .ele) holds all points in input order, duplicates too, and the tetrahedra in an order\n"
    "that does not depend on the number of threads. Without -o only the statistics are printed.\n"
    "\n"
    "  -o, --output FILE   where the tetrahedra go\n"
    "  --hull FILE         write the triangles of the convex hull, tagged by flat polygon\n"
    "  --weights FILE      a number for each point, as text: makes the regular triangulation (power\n"
    "                      diagram)\n"
    "  --threads N         default: what OpenMP chooses\n"
    "  --any-order         leave the tetrahedra in the order in which they were made (faster)\n"
    "  --validate          prove that the result is Delaunay\n"
    "  -q, --quiet         print nothing but errors\n"
    "  --help, --version\n"
    "\n"
    "exit codes: 0 ok, 2 usage, 3 cannot read, 4 cannot write, 5 the points do not span space (fewer\n"
    "than four, or all equal, on a line or in a plane), or a coordinate is not finite or out of\n"
    "range, 7 memory, 8 interrupted, 70 internal error\n";

typedef struct arguments {
    const char *input, *output, *hull, *weights;
    int threads, any_order, validate, quiet;
} arguments;

/* Whether the files that are written replace neither one that is read nor each other; if not, says
 * so. */
static int files_are_apart(const arguments *args)
{
    const meshio_format input = meshio_format_of(args->input),
                        output = args->output ? meshio_format_of(args->output)
                                              : MESHIO_FORMAT_AUTO,
                        hull = args->hull ? meshio_format_of(args->hull) : MESHIO_FORMAT_AUTO;
    const int has_nodes = input == MESHIO_FORMAT_NODE || input == MESHIO_FORMAT_POLY ||
                          input == MESHIO_FORMAT_SMESH;
    if (has_nodes && output == MESHIO_FORMAT_ELE &&
        !tool_spares_nodes("delaunay", "--output", args->output, args->input))
        return 0;
    if (has_nodes && hull == MESHIO_FORMAT_ELE &&
        !tool_spares_nodes("delaunay", "--hull", args->hull, args->input))
        return 0;
    return tool_spares("delaunay", "--hull", args->hull, args->input) &&
           tool_clears_output("delaunay", "--hull", args->hull, args->output,
                              output == MESHIO_FORMAT_ELE) &&
           tool_is_apart("delaunay", "--output", args->output, args->weights) &&
           tool_is_apart("delaunay", "--hull", args->hull, args->weights);
}

/* Whether the arguments go together; if not, says why. */
static int arguments_fit(const arguments *args)
{
    if (!args->input) {
        fprintf(stderr, "delaunay: no file of points; try --help\n");
        return 0;
    }
    if (!files_are_apart(args)) return 0;
    if (args->output && !meshio_holds_tetrahedra(meshio_format_of(args->output))) {
        fprintf(stderr, "delaunay: no tetrahedra can be written to '%s'; try .mesh, .msh or .vtu\n",
                args->output);
        return 0;
    }
    if (args->hull && !meshio_holds_triangles(meshio_format_of(args->hull))) {
        fprintf(stderr, "delaunay: '%s' is of no format for triangles; try .off, .stl or .vtu\n",
                args->hull);
        return 0;
    }
    return 1;
}

/* What the options with a value need. */
static const tool_need needs[] = {{"-o", "the name of a file", 0, 0},
                                  {"--output", "the name of a file", 0, 0},
                                  {"--hull", "the name of a file", 0, 0},
                                  {"--weights", "the name of a file", 0, 0},
                                  {"--threads", "a number from 1 to 4096", 1, 4096},
                                  {NULL, NULL, 0, 0}};

/* Returns 0: go on; 1: done (--help, --version); 2: wrong usage. */
static int parse(int argc, char **argv, arguments *args)
{
    int i;
    double value;
    for (i = 1; i < argc; i++) {
        const char *a = argv[i];
        if (strcmp(a, "--help") == 0 || strcmp(a, "-h") == 0) {
            fputs(help, stdout);
            return 1;
        } else if (strcmp(a, "--version") == 0) {
            printf("delaunay %d.%d.%d\n", DELAUNAY_VERSION / 10000, DELAUNAY_VERSION / 100 % 100,
                   DELAUNAY_VERSION % 100);
            return 1;
        } else if ((strcmp(a, "-o") == 0 || strcmp(a, "--output") == 0) && i + 1 < argc) {
            args->output = tool_output_name(argv[++i]);
        } else if (strcmp(a, "--hull") == 0 && i + 1 < argc) {
            args->hull = tool_output_name(argv[++i]);
        } else if (strcmp(a, "--weights") == 0 && i + 1 < argc) {
            args->weights = argv[++i];
        } else if (tool_needed_number(needs, a, argv[i + 1], &value)) { /* --threads */
            args->threads = (int)value;
            i++;
        } else if (strcmp(a, "--any-order") == 0) {
            args->any_order = 1;
        } else if (strcmp(a, "--validate") == 0) {
            args->validate = 1;
        } else if (strcmp(a, "-q") == 0 || strcmp(a, "--quiet") == 0) {
            args->quiet = 1;
        } else if (a[0] == '-' || args->input) {
            tool_complain("delaunay", needs, a, argv[i + 1]);
            return 2;
        } else {
            args->input = a;
        }
    }
    if (!arguments_fit(args)) return 2;
    if (tool_is_stdout(args->output) || tool_is_stdout(args->hull)) args->quiet = 1;
    return 0;
}

static int exit_code(delaunay_result result)
{
    switch (result) {
    case DELAUNAY_OK: return TOOL_OK;
    case DELAUNAY_ERROR_DIMENSION:
    case DELAUNAY_ERROR_NOT_FINITE: return TOOL_BAD_SURFACE;
    case DELAUNAY_ERROR_OUT_OF_MEMORY:
    case DELAUNAY_ERROR_TOO_LARGE: return TOOL_NO_MEMORY;
    case DELAUNAY_CANCELLED: return TOOL_STOPPED;
    default: return TOOL_INTERNAL;
    }
}

/* A sentence that says why there is no triangulation. */
static const char *reason(delaunay_result result, const delaunay_report *report)
{
    static const char *const spanned[] = {"all points are equal", "all points lie on one line",
                                          "all points lie in one plane"};
    if (result == DELAUNAY_ERROR_DIMENSION && report->num_points == 0) return "there are no points";
    if (result == DELAUNAY_ERROR_DIMENSION && report->dimension >= 0 && report->dimension < 3)
        return spanned[report->dimension];
    return report->message[0] ? report->message : delaunay_result_string(result);
}

static void print_statistics(const delaunay_report *report, uint64_t num_tets, double seconds_read,
                             double seconds)
{
    printf("points      %llu (%llu duplicates)\n", (unsigned long long)report->num_points,
           (unsigned long long)report->num_duplicates);
    if (report->num_hidden)
        printf("hidden      %llu\n", (unsigned long long)report->num_hidden);
    printf("tetrahedra  %llu\n", (unsigned long long)num_tets);
    printf("read        %9.3f s\n", seconds_read);
    printf("sort        %9.3f s\n", report->seconds_sort);
    printf("insert      %9.3f s\n", report->seconds_insert);
    printf("finish      %9.3f s\n", report->seconds_finish);
    printf("total       %9.3f s, %.3f million tetrahedra/s\n", seconds,
           seconds > 0 ? 1e-6 * (double)num_tets / seconds : 0);
    if (tool_peak_bytes() > 0) printf("peak memory %9.1f MB\n", 1e-6 * tool_peak_bytes());
}

/* Copies the tetrahedra into the mesh that holds the points, without freeing what that had before.
 * Returns 0 if memory runs out. */
static int export_tets(const delaunay_mesh *mesh, meshio_mesh *points)
{
    uint64_t num = delaunay_export_tets(mesh, NULL, 0), i;
    points->num_tets = 0;
    points->tets = (uint32_t *)malloc((size_t)num * 4 * sizeof(uint32_t) + 1);
    points->tet_tags = (int32_t *)malloc((size_t)num * sizeof(int32_t) + 1);
    if (!points->tets || !points->tet_tags) return 0;
    points->num_tets = (size_t)delaunay_export_tets(mesh, points->tets, num);
    for (i = 0; i < num; i++) points->tet_tags[i] = 1;
    return 1;
}

static void drop_elements(meshio_mesh *m)
{
    free(m->edges);
    free(m->edge_tags);
    free(m->triangles);
    free(m->triangle_tags);
    free(m->tets);
    free(m->tet_tags);
    m->edges = m->triangles = m->tets = NULL;
    m->edge_tags = m->triangle_tags = m->tet_tags = NULL;
    m->num_edges = m->num_triangles = m->num_tets = 0;
}

/* Reads count numbers, one for each point. Returns NULL on failure; *code then says why. */
static double *read_weights(const char *name, size_t count, int *code)
{
    FILE *file = fopen(name, "r");
    double *weights = (double *)malloc(count * sizeof *weights + 1);
    size_t n = 0;
    char more;
    *code = weights ? TOOL_CANNOT_READ : TOOL_NO_MEMORY;
    while (file && weights && n < count && fscanf(file, "%lf", &weights[n]) == 1) n++;
    if (file && weights && n == count && fscanf(file, " %c", &more) == EOF && !ferror(file))
        *code = TOOL_OK;
    if (file) fclose(file);
    if (*code == TOOL_OK) return weights;
    if (!weights) fprintf(stderr, "delaunay: out of memory\n");
    else if (!file) fprintf(stderr, "delaunay: %s: cannot open\n", name);
    else fprintf(stderr, "delaunay: %s: not one number for each of %lu points\n", name,
                 (unsigned long)count);
    free(weights);
    return NULL;
}

/* Replaces the elements of the mesh that holds the points by the triangles of the hull, and writes
 * it to the file of --hull. */
static int write_hull(const arguments *args, const delaunay_mesh *mesh, meshio_mesh *points)
{
    delaunay_hull hull;
    meshio_report io;
    size_t i;
    int code = TOOL_NO_MEMORY;
    memset(&hull, 0, sizeof hull);
    drop_elements(points);
    if (delaunay_hull_of(&hull, mesh, NULL) == DELAUNAY_OK) {
        points->triangles = (uint32_t *)malloc(hull.num_facets * 3 * sizeof(uint32_t));
        points->triangle_tags = (int32_t *)malloc(hull.num_facets * sizeof(int32_t));
    }
    if (!points->triangles || !points->triangle_tags) {
        fprintf(stderr, "delaunay: out of memory\n");
    } else {
        for (i = 0; i < 3 * hull.num_facets; i++)
            points->triangles[i] = mesh->vertex_id[hull.facets[i]];
        for (i = 0; i < hull.num_facets; i++)
            points->triangle_tags[i] = (int32_t)hull.facet_polygon[i] + 1;
        points->num_triangles = hull.num_facets;
        code = meshio_write(args->hull, points, NULL, &io) == MESHIO_OK ? TOOL_OK
                                                                        : TOOL_CANNOT_WRITE;
        if (code != TOOL_OK) fprintf(stderr, "delaunay: %s\n", io.message);
        else if (!args->quiet)
            printf("hull        %lu triangles, %lu polygons\n", (unsigned long)hull.num_facets,
                   (unsigned long)hull.num_polygons);
    }
    delaunay_hull_free(&hull);
    return code;
}

/* Triangulates the points, with the weights of --weights. seconds: gets what this took. */
static int make_mesh(const arguments *args, const meshio_mesh *points, delaunay_mesh *mesh,
                     delaunay_report *report, double *seconds)
{
    delaunay_options options;
    delaunay_result result;
    delaunay_points input;
    double start, *weights = NULL;
    int code;
    memset(&input, 0, sizeof input);
    memset(&options, 0, sizeof options);
    options.any_order = args->any_order;
    options.host.num_threads = args->threads;
    options.host.progress = tool_progress;
    if (args->weights) {
        weights = read_weights(args->weights, points->num_vertices, &code);
        if (!weights) return code;
    }
    input.xyz = points->xyz;
    input.count = points->num_vertices;
    input.weights = weights;
    if (!tool_can_create("delaunay", args->output) || !tool_can_create("delaunay", args->hull)) {
        free(weights);
        return TOOL_CANNOT_WRITE;
    }
    start = tool_seconds();
    result = delaunay_tetrahedralize_points(mesh, &input, &options, report);
    *seconds = tool_seconds() - start;
    free(weights);
    code = exit_code(result);
    if (code != TOOL_OK)
        fprintf(stderr, "delaunay: %s: %s\n", args->input, reason(result, report));
    return code;
}

/* Proves that the mesh is Delaunay, for --validate. */
static int prove(const arguments *args, const delaunay_mesh *mesh)
{
    delaunay_host host;
    delaunay_report proof;
    memset(&host, 0, sizeof host);
    memset(&proof, 0, sizeof proof);
    host.num_threads = args->threads;
    host.progress = tool_progress;
    if (delaunay_validate_on(mesh, DELAUNAY_VALIDATE_DELAUNAY, &host, &proof) == DELAUNAY_OK)
        return TOOL_OK;
    fprintf(stderr, "delaunay: internal error: %s\n", proof.message);
    return TOOL_INTERNAL;
}

static int triangulate(const arguments *args, meshio_mesh *points, double seconds_read)
{
    delaunay_mesh mesh;
    delaunay_report report;
    meshio_report io;
    double seconds = 0;
    int code;
    memset(&mesh, 0, sizeof mesh);
    memset(&report, 0, sizeof report);
    code = make_mesh(args, points, &mesh, &report, &seconds);
    if (code == TOOL_OK && args->validate) code = prove(args, &mesh);
    if (code == TOOL_OK && args->hull) code = write_hull(args, &mesh, points);
    if (code == TOOL_OK) {
        drop_elements(points);
        if (!export_tets(&mesh, points)) {
            fprintf(stderr, "delaunay: out of memory\n");
            code = TOOL_NO_MEMORY;
        }
    }
    delaunay_mesh_free(&mesh);
    if (code != TOOL_OK) return code;
    if (args->output && meshio_write(args->output, points, NULL, &io) != MESHIO_OK) {
        fprintf(stderr, "delaunay: %s\n", io.message);
        return TOOL_CANNOT_WRITE;
    }
    if (!args->quiet) print_statistics(&report, points->num_tets, seconds_read, seconds);
    return TOOL_OK;
}

int main(int argc, char **argv)
{
    arguments args;
    meshio_mesh points;
    meshio_report report;
    meshio_result result;
    double start;
    int code;
    memset(&args, 0, sizeof args);
    code = parse(argc, argv, &args);
    if (code) return tool_end("delaunay", code == 1 ? TOOL_OK : TOOL_USAGE);
    if (!tool_is_exact("delaunay")) return TOOL_INTERNAL;
    tool_catch_signals();
    start = tool_seconds();
    result = meshio_read(args.input, MESHIO_FORMAT_AUTO, &points, &report);
    if (result != MESHIO_OK) {
        fprintf(stderr, "delaunay: %s: %s\n", args.input, report.message);
        return result == MESHIO_ERROR_OUT_OF_MEMORY ? TOOL_NO_MEMORY : TOOL_CANNOT_READ;
    }
    code = triangulate(&args, &points, tool_seconds() - start);
    meshio_free(&points);
    return tool_end("delaunay", code);
}
