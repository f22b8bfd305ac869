/* Tests of examples/meshio.h: round trips through every writer, unusual files of all formats, every
 * kind of damaged file (small, made by the program), failing allocations, failing writes. */
#include <stdlib.h>
static void *test_malloc(size_t size);
static void *test_realloc(void *old, size_t size);
static void test_free(void *pointer);
#define MESHIO_MALLOC(size) test_malloc(size)
#define MESHIO_REALLOC(pointer, size) test_realloc(pointer, size)
#define MESHIO_FREE(pointer) test_free(pointer)
#define MESHIO_IMPLEMENTATION
#include "examples/meshio.h"
#include "check.h"

/* ---- memory that can be made to fail ---- */

static long live_blocks, allocations, fail_at = -1;

static void *test_malloc(size_t size)
{
    void *p;
    if (allocations++ == fail_at) return NULL;
    p = malloc(size ? size : 1);
    live_blocks += p != NULL;
    return p;
}

static void *test_realloc(void *old, size_t size)
{
    void *p;
    if (allocations++ == fail_at) return NULL;
    p = realloc(old, size);
    live_blocks += p != NULL && old == NULL;
    return p;
}

static void test_free(void *pointer)
{
    live_blocks -= pointer != NULL;
    free(pointer);
}

/* ---- helpers ---- */

static uint64_t random_state = 1;

static uint64_t random_u64(void)
{
    uint64_t z = random_state += UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ z >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ z >> 27) * UINT64_C(0x94D049BB133111EB);
    return z ^ z >> 31;
}

static double random_double(void) { return (double)(random_u64() >> 11) / 9007199254740992.0; }

static const char *file_name(const char *extension)
{
    static char name[64];
    static int in_build = -1;
    if (in_build < 0) {
        FILE *f = fopen("build/test_meshio.probe", "wb");
        in_build = f != NULL;
        if (f) fclose(f), remove("build/test_meshio.probe");
    }
    snprintf(name, sizeof name, "%stest_meshio_out.%s", in_build ? "build/" : "", extension);
    return name;
}

static int exists(const char *path)
{
    FILE *f = fopen(path, "rb");
    if (f) fclose(f);
    return f != NULL;
}

/* A whole file in memory; the caller frees it. */
static char *load(const char *path, size_t *size)
{
    FILE *f = fopen(path, "rb");
    char *bytes;
    long n;
    *size = 0;
    if (!f) return NULL;
    fseek(f, 0, SEEK_END);
    n = ftell(f);
    rewind(f);
    bytes = (char *)malloc((size_t)n + 1);
    *size = fread(bytes, 1, (size_t)n, f);
    fclose(f);
    return bytes;
}

static meshio_result read_text(meshio_format format, const char *text, meshio_mesh *mesh,
                               meshio_report *report)
{
    return meshio_read_memory(text, strlen(text), format, mesh, report);
}

/* Two tetrahedra glued at a face, their surface, two edges; awkward coordinates and tags. */
static double sample_xyz[18] = {0, 0, 0, 1, 0, 0, 0.1, 1.0 / 3, 0, 0, 0, 1e-300, 1e300, -0.0,
                                12345678.901234567, -1, 2.2250738585072014e-308, 5e-324};
static int32_t sample_vertex_tags[6] = {0, 1, 2, -3, 2147483647, 5};
static uint32_t sample_edges[4] = {0, 1, 4, 5};
static int32_t sample_edge_tags[2] = {7, 8};
static uint32_t sample_triangles[18] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2, 4, 1, 2, 5, 1, 4};
static int32_t sample_triangle_tags[6] = {1, 1, 2, 3, 3, 3};
static uint32_t sample_tets[8] = {0, 1, 2, 3, 1, 2, 3, 4};
static int32_t sample_tet_tags[2] = {2, 1};

static meshio_mesh sample(void)
{
    meshio_mesh m;
    memset(&m, 0, sizeof m);
    m.xyz = sample_xyz;
    m.num_vertices = 6;
    m.vertex_tags = sample_vertex_tags;
    m.edges = sample_edges;
    m.edge_tags = sample_edge_tags;
    m.num_edges = 2;
    m.triangles = sample_triangles;
    m.triangle_tags = sample_triangle_tags;
    m.num_triangles = 6;
    m.tets = sample_tets;
    m.tet_tags = sample_tet_tags;
    m.num_tets = 2;
    strcpy(m.name, "sample");
    return m;
}

static int same_bits(const double *a, const double *b, size_t n)
{
    return memcmp(a, b, n * sizeof(double)) == 0;
}

/* Is this tetrahedron with this tag in the mesh? (MSH 4.1 groups elements by tag.) */
static int has_element(const uint32_t *all, const int32_t *tags, size_t num, int k,
                       const uint32_t *v, int32_t tag)
{
    size_t i;
    for (i = 0; i < num; i++)
        if (tags[i] == tag && memcmp(all + (size_t)k * i, v, (size_t)k * sizeof *v) == 0) return 1;
    return 0;
}

static void put32(unsigned char *p, uint32_t v) { memcpy(p, &v, 4); }

#define PLY "ply\nformat ascii 1.0\nelement vertex "
#define XYZ "\nproperty float x\nproperty float y\nproperty float z\n"

static double triangle_area_z(const meshio_mesh *m, size_t t)
{
    const double *a = m->xyz + 3 * (size_t)m->triangles[3 * t];
    const double *b = m->xyz + 3 * (size_t)m->triangles[3 * t + 1];
    const double *c = m->xyz + 3 * (size_t)m->triangles[3 * t + 2];
    return ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
}

/* ---- numbers ---- */

static int parses_like_strtod(const char *text)
{
    double mine = 0, theirs = strtod(text, NULL);
    size_t used = meshio_parse_double(text, strlen(text), &mine);
    return used == strlen(text) && memcmp(&mine, &theirs, sizeof mine) == 0;
}

static void doubles_are_correctly_rounded(void)
{
    static const char *const hard[] = {"0",
                                       "-0",
                                       "1",
                                       "0.1",
                                       "-.5",
                                       "5.",
                                       "1e22",
                                       "1e23",
                                       "9007199254740993",
                                       "9007199254740992.5",
                                       "1.7976931348623157e308",
                                       "1e999",
                                       "-1e999",
                                       "4.9406564584124654e-324",
                                       "2.4703282292062327e-324",
                                       "2.4703282292062328e-324",
                                       "123456789012345678901234567890",
                                       "0.000000000000000000000000000000000001",
                                       "8.5e-05",
                                       "1E5",
                                       "1e+5",
                                       "0.500000000000000166533453693773481063544750213623046875",
                                       "18446744073709551615",
                                       "36893488147419103232",
                                       "9007199254740993e-1",
                                       "72057594037927945",
                                       "7205759403792793.5",
                                       "0.30000000000000004",
                                       "179769313486231580793e289",
                                       "00000000000000000000000000000001.5"};
    size_t i;
    int k;
    for (i = 0; i < sizeof hard / sizeof hard[0]; i++) CHECK(parses_like_strtod(hard[i]));
    for (k = 0; k < 200000; k++) {
        char text[64];
        uint64_t bits = random_u64();
        double d;
        int bad;
        if (k % 4 == 0) {
            memcpy(&d, &bits, 8);
            if (!(fabs(d) < 1e308)) continue;
        } else {
            d = ((double)(int64_t)bits) * pow(10, -(double)(random_u64() % 24));
        }
        snprintf(text, sizeof text, "%.*g", k % 3 ? 17 : 1 + (int)(random_u64() % 18), d);
        bad = !parses_like_strtod(text);
        if (bad) printf("misread: %s\n", text);
        if (bad || k % 1000 == 1) CHECK(!bad);
    }
}

static void halfway_cases_are_rounded_to_even(void)
{
    int k, bad = 0;
    for (k = 0; k < 20000; k++) { /* 54-bit integers that lie between two doubles, shifted */
        char text[64];
        uint64_t m = ((UINT64_C(1) << 53) | (random_u64() >> 11)) | 1;
        snprintf(text, sizeof text, "%llu%s", (unsigned long long)m, k & 1 ? "" : ".0000");
        bad += !parses_like_strtod(text);
        snprintf(text, sizeof text, "%llue-%d", (unsigned long long)(m * 5), 1);
        bad += !parses_like_strtod(text);
    }
    CHECK(bad == 0);
}

/* Numbers of any length, with an e and with a d. */
static void fortran_exponents_are_like_others(void)
{
    static const int lengths[] = {1, 5, 20, 60, 62, 63, 64, 65, 100, 779, 780, 781, 790, 2000};
    char text[6000], other[6000];
    size_t i, length;
    int bad = 0, k;
    double mine, theirs;
    for (i = 0; i < sizeof lengths / sizeof lengths[0]; i++)
        for (k = 0; k < 200; k++) {
            int n = 0, j, point = (int)(random_u64() % (unsigned)(lengths[i] + 1));
            if (k & 1) text[n++] = '-';
            for (j = 0; j < lengths[i]; j++) {
                if (j == point) text[n++] = '.';
                text[n++] = (char)(k % 8 < 2 && j < lengths[i] - 1 ? '0' : '0' + random_u64() % 10);
            }
            sprintf(text + n, "e%d", (int)(random_u64() % 700) - 350 - point);
            strcpy(other, text);
            *strchr(other, 'e') = k & 2 ? 'd' : 'D';
            length = strlen(text);
            theirs = strtod(text, NULL);
            if (meshio_parse_double(other, length, &mine) != length ||
                memcmp(&mine, &theirs, sizeof mine) != 0)
                bad++;
        }
    CHECK(bad == 0);
    strcpy(text, "1"); /* 1 + 2^-53 and zeros; then something more */
    strcat(text, ".00000000000000011102230246251565404236316680908203125");
    for (i = 0; i < 2000; i++) strcat(text, "0");
    strcpy(other, text);
    strcat(text, "d0");
    strcat(other, "1d0");
    CHECK(meshio_parse_double(text, strlen(text), &mine) == strlen(text) && mine == 1);
    CHECK(meshio_parse_double(other, strlen(other), &mine) == strlen(other) &&
          mine == 1 + DBL_EPSILON);
    CHECK(meshio_parse_double("1d99999999999999999999", 22, &mine) == 22 && mine > 1e308);
    CHECK(meshio_parse_double("-1d-99999999999999999999", 24, &mine) == 24 && mine == 0);
    CHECK(meshio_parse_double("0d99999999999999999999", 22, &mine) == 22 && mine == 0);
}

/* Coordinates of every size, many near a power of ten or halfway between two decimals. */
static double some_coordinate(int kind)
{
    uint64_t r = random_u64();
    double value = 1;
    uint64_t i;
    switch (kind) {
    case 0:
        memcpy(&value, &r, 8);
        return value;
    case 1:
        return random_double() * 2000 - 1000;
    case 2:
        return (double)(int64_t)(r % 2000001 - 1000000) / 1000;
    case 3:
        return (double)(int64_t)(r >> 40) / 1024;
    case 4:
        for (i = r % 22; i > 0; i--) value *= 10;
        return value * (1 + ((double)(r >> 60) - 8) / 4503599627370496.0) / 1e6;
    default:
        for (i = r % 70; i > 0; i--) value /= 2;
        return -value * (double)(random_u64() >> (11 + r / 70 % 42));
    }
}

/* What is written is what printf("%.17g") would write, whatever wrote it. */
static void doubles_are_written_like_printf(void)
{
    const uint32_t n = 100000;
    double *xyz = (double *)malloc(3 * n * sizeof *xyz);
    const char *name = file_name(".node");
    char *text, *line, expected[160];
    meshio_mesh m;
    size_t size;
    uint32_t i, bad = 0;
    memset(&m, 0, sizeof m);
    for (i = 0; i < 3 * n; i++)
        do xyz[i] = some_coordinate((int)(i % 6));
        while (!(xyz[i] - xyz[i] == 0));
    m.xyz = xyz;
    m.num_vertices = n;
    CHECK(meshio_write(name, &m, NULL, NULL) == MESHIO_OK);
    text = load(name, &size);
    if (text) text[size] = 0;
    line = text ? strchr(text, '\n') : NULL;
    for (i = 0; i < n && line; i++) {
        const double *x = xyz + 3 * i;
        char *end = strchr(line + 1, '\n'), *first = strchr(line + 1, ' ');
        snprintf(expected, sizeof expected, " %.17g %.17g %.17g", x[0], x[1], x[2]);
        if (!end || !first || strncmp(first, expected, strlen(expected)) != 0) bad++;
        line = end;
    }
    CHECK(i == n && bad == 0);
    free(text);
    free(xyz);
    remove(name);
}

/* Lists that are long enough to be shared by threads. */
static void text_does_not_depend_on_threads(void)
{
    static const char *const extensions[] = {".mesh", ".msh", ".msh"};
    const uint32_t n = 120000;
    double *xyz = (double *)malloc(3 * n * sizeof *xyz);
    uint32_t *tets = (uint32_t *)malloc(4 * n * sizeof *tets);
    int32_t *tags = (int32_t *)malloc(n * sizeof *tags);
    meshio_write_options options;
    meshio_mesh m;
    size_t size[2], i;
    char *text[2];
    memset(&m, 0, sizeof m);
    memset(&options, 0, sizeof options);
    for (i = 0; i < 3 * n; i++) xyz[i] = random_double() * 2000 - 1000;
    for (i = 0; i < 4 * n; i++) tets[i] = (uint32_t)(random_u64() % n);
    for (i = 0; i < n; i++) tags[i] = (int32_t)(i / 18000) - 2;
    m.xyz = xyz;
    m.num_vertices = n;
    m.tets = tets;
    m.tet_tags = tags;
    m.num_tets = n;
    for (i = 0; i < sizeof extensions / sizeof extensions[0]; i++) {
        const char *name = file_name(extensions[i]);
        options.binary = i == 2;
        options.num_threads = 0;
        CHECK(meshio_write(name, &m, &options, NULL) == MESHIO_OK);
        text[0] = load(name, &size[0]);
        for (options.num_threads = 1; options.num_threads < 10; options.num_threads += 3) {
            CHECK(meshio_write(name, &m, &options, NULL) == MESHIO_OK);
            text[1] = load(name, &size[1]);
            CHECK(text[0] && text[1] && size[0] == size[1] &&
                  memcmp(text[0], text[1], size[0]) == 0);
            free(text[1]);
        }
        free(text[0]);
        remove(name);
    }
    free(xyz);
    free(tets);
    free(tags);
}

static void words_are_not_numbers(void)
{
    static const char *const bad[] = {"", "-", ".", "e5", "x", "+-1", "-x", "--1"};
    double d;
    size_t i;
    for (i = 0; i < sizeof bad / sizeof bad[0]; i++)
        CHECK(meshio_parse_double(bad[i], strlen(bad[i]), &d) == 0);
    CHECK(meshio_parse_double("inf", 3, &d) == 3 && d > 1e308);
    CHECK(meshio_parse_double("-Infinity", 9, &d) == 9 && d < -1e308);
    CHECK(meshio_parse_double("nan", 3, &d) == 3 && d != d);
    CHECK(meshio_parse_double("1.5D-3", 6, &d) == 6 && d == 1.5e-3);
    CHECK(meshio_parse_double("0x10", 4, &d) == 1);
}

/* As C says, and as Windows has written it. */
static void numbers_may_be_infinite_or_none(void)
{
    static const struct {
        const char *text;
        size_t length;
        int sign; /* 0: not a number; 3: the finite number 1 */
    } numbers[] = {{"1.#INF", 6, 1},      {"-1.#INF00 ", 9, -1}, {"+1.#INF000,", 10, 1},
                   {"-1.#IND", 7, 0},     {"1.#IND00\n", 8, 0},  {"1.#QNAN0", 8, 0},
                   {"-1.#SNAN", 8, 0},    {"1.#J", 4, 0},        {"-1.#IO<", 6, 0},
                   {"nan(ind)", 8, 0},    {"-nan(snan) ", 10, 0}, {"nan()", 5, 0},
                   {"nan(0x7_a", 3, 0},   {"nan(a b)", 3, 0},    {"1.#", 2, 3},
                   {"1.#inf", 2, 3},      {"1.#INF2", 2, 3},     {"1.#INFINITY", 2, 3},
                   {"1.#A word", 4, 0},   {"1.# A", 2, 3},       {"1.0#INF", 3, 3}};
    size_t i;
    for (i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        double d = 7;
        int right = meshio_parse_double(numbers[i].text, strlen(numbers[i].text), &d) ==
                    numbers[i].length;
        if (numbers[i].sign == 0)
            right = right && d != d;
        else
            right = right && d == (numbers[i].sign == 3 ? 1 : numbers[i].sign * HUGE_VAL);
        if (!right) printf("misread: %s\n", numbers[i].text);
        CHECK(right);
    }
}

/* ---- round trips ---- */

static void check_round_trip(const char *extension, int binary, int ascii)
{
    meshio_mesh m = sample(), back;
    meshio_report report;
    meshio_write_options options;
    meshio_field field;
    double quality[2] = {0.25, 1.0};
    const char *name = file_name(extension);
    int has_vertex_tags = strncmp(extension, "mesh", 4) == 0 || strcmp(extension, "ele") == 0;
    size_t i;
    memset(&options, 0, sizeof options);
    memset(&field, 0, sizeof field);
    field.name = "quality";
    field.tets = quality;
    options.binary = binary;
    options.ascii = ascii;
    options.fields = &field;
    options.num_fields = 1;
    CHECK(meshio_write(name, &m, &options, &report) == MESHIO_OK);
    CHECK(report.message[0] == 0);
    CHECK(meshio_read(name, MESHIO_FORMAT_AUTO, &back, &report) == MESHIO_OK);
    if (report.message[0]) printf("%s: %s\n", extension, report.message);
    CHECK(back.num_vertices == 6 && back.num_tets == 2);
    if (back.num_vertices == 6) {
        CHECK(same_bits(back.xyz, m.xyz, 18));
        if (has_vertex_tags) CHECK(memcmp(back.vertex_tags, m.vertex_tags, 24) == 0);
    }
    for (i = 0; i < 2; i++)
        CHECK(
            has_element(back.tets, back.tet_tags, back.num_tets, 4, m.tets + 4 * i, m.tet_tags[i]));
    CHECK(back.num_triangles == 6);
    for (i = 0; i < 6; i++)
        CHECK(has_element(back.triangles, back.triangle_tags, back.num_triangles, 3,
                          m.triangles + 3 * i, m.triangle_tags[i]));
    if (strcmp(extension, "ele") != 0) {
        CHECK(back.num_edges == 2);
        for (i = 0; i < 2; i++)
            CHECK(has_element(back.edges, back.edge_tags, back.num_edges, 2, m.edges + 2 * i,
                              m.edge_tags[i]));
    }
    meshio_free(&back);
    remove(name);
    if (strcmp(extension, "ele") == 0) {
        CHECK(exists(file_name("node")) && exists(file_name("face")));
        remove(file_name("node"));
        remove(file_name("face"));
    }
}

/* TetGen's files beside an .ele file: faces may be missing, have no markers, or have other numbers
 * after these; what is wrong with them is said of the file where it is. */
static void faces_beside_elements(void)
{
    static const struct {
        const char *tets, *faces; /* NULL: no file */
        int32_t tag;              /* of the only face; -1: there is none */
        const char *message;
    } cases[] = {
        {"1 4 0\n1 1 2 3 4\n", NULL, -1, NULL},
        {"1 4 0\n1 1 2 3 4\n", "1 1\n1 3 2 1 7\n", 7, NULL},
        {"1 4 0\n1 1 2 3 4\n", "1 0\n1 3 2 1\n", 0, NULL},
        {"1 4 0\n1 1 2 3 4\n", "1 0\n1 3 2 1 5 -1\n", 0, NULL},
        {"1 4 0\n1 1 2 3 4\n", "1 1\n1 3 2 1 8 5 -1\n", 8, NULL},
        {"1 10 0\n1 1 2 3 4 5 5 5 5 5 5\n", "1 1\n1 3 2 1 5 5 5 9\n", 9, NULL},
        {"1 4 0\n1 1 2 3 4\n", "1 1\n\n1 3 2 6 7\n", -1, ".face file beside it, line 3"},
        {"1 4 0\n1 1 2 3 4\n", "2 1\n1 3 2 1 7\n", -1, ".face file beside it, line"},
    };
    size_t k;
    for (k = 0; k < sizeof cases / sizeof *cases; k++) {
        meshio_mesh m;
        meshio_report report;
        FILE *f = fopen(file_name("node"), "wb");
        fputs("5 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 .5 0 0\n", f);
        fclose(f);
        f = fopen(file_name("ele"), "wb");
        fputs(cases[k].tets, f);
        fclose(f);
        if (cases[k].faces) {
            f = fopen(file_name("face"), "wb");
            fputs(cases[k].faces, f);
            fclose(f);
        }
        CHECK((meshio_read(file_name("ele"), MESHIO_FORMAT_AUTO, &m, &report) == MESHIO_OK) ==
              !cases[k].message);
        CHECK(cases[k].message ? strstr(report.message, cases[k].message) != NULL
                               : report.message[0] == 0 && m.num_tets == 1);
        CHECK(m.num_triangles == (cases[k].tag >= 0));
        if (m.num_triangles == 1)
            CHECK(m.triangle_tags[0] == cases[k].tag && m.triangles[0] == 2);
        meshio_free(&m);
        remove(file_name("node"));
        remove(file_name("ele"));
        remove(file_name("face"));
    }
}

static void volume_formats_keep_every_bit(void)
{
    check_round_trip("mesh", 0, 0);
    check_round_trip("meshb", 0, 0);
    check_round_trip("msh", 0, 0);
    check_round_trip("msh", 1, 0);
    check_round_trip("msh4", 0, 0);
    check_round_trip("msh4", 1, 0);
    check_round_trip("vtu", 0, 0);
    check_round_trip("vtu", 0, 1);
    check_round_trip("vtk", 0, 0);
    check_round_trip("vtk", 1, 0);
    check_round_trip("ele", 0, 0);
}

/* Regions as element sets, triangles as surfaces, or as elements where no tetrahedron has them. */
static void inp_keeps_regions_and_surfaces(void)
{
    int32_t extremes[6] = {INT32_MAX, INT32_MIN, 1, -1, INT32_MAX, INT32_MIN};
    meshio_mesh m = sample(), back;
    const char *name = file_name("inp");
    char *text;
    size_t i, size, length = 0, longest = 0;
    CHECK(meshio_write(name, &m, NULL, NULL) == MESHIO_OK);
    CHECK(meshio_read(name, MESHIO_FORMAT_AUTO, &back, NULL) == MESHIO_OK);
    CHECK(back.num_vertices == 6 && back.num_tets == 2 && back.num_triangles == 6);
    for (i = 0; i < 18 && back.num_vertices == 6; i++)
        CHECK(fabs(back.xyz[i] - m.xyz[i]) <= 1e-12 * fabs(m.xyz[i]));
    for (i = 0; i < 2; i++)
        CHECK(
            has_element(back.tets, back.tet_tags, back.num_tets, 4, m.tets + 4 * i, m.tet_tags[i]));
    for (i = 0; i < 6; i++) { /* they may begin at another corner */
        const uint32_t *v = m.triangles + 3 * i;
        int k, found = 0;
        for (k = 0; k < 3; k++) {
            uint32_t turned[3];
            turned[0] = v[k], turned[1] = v[(k + 1) % 3], turned[2] = v[(k + 2) % 3];
            found += has_element(back.triangles, back.triangle_tags, back.num_triangles, 3, turned,
                                 m.triangle_tags[i]);
        }
        CHECK(found == 1);
    }
    meshio_free(&back);
    text = load(name, &size);
    CHECK(text != NULL);
    for (i = 0; text && i < size; i++) {
        length = strchr(",\n", text[i]) || text[i] < '-' ? 0 : length + 1;
        if (length > longest && i > 20) longest = length;
    }
    CHECK(longest <= 20);
    free(text);
    m.tet_tags = m.triangle_tags = extremes;
    CHECK(meshio_write(name, &m, NULL, NULL) == MESHIO_OK);
    CHECK(meshio_read(name, MESHIO_FORMAT_AUTO, &back, NULL) == MESHIO_OK);
    for (i = 0; i < 2; i++)
        CHECK(
            has_element(back.tets, back.tet_tags, back.num_tets, 4, m.tets + 4 * i, m.tet_tags[i]));
    for (i = 0; i < back.num_triangles; i++)
        if (back.triangle_tags[i] == INT32_MIN) break;
    CHECK(i < back.num_triangles);
    meshio_free(&back);
    remove(name);
}

static void inp_has_elements_of_ten_nodes(void)
{
    static double xyz[30];
    static uint32_t tet[10] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}, triangle[6] = {0, 2, 1, 6, 5, 4};
    static int32_t tag[1] = {-2147483647};
    static const char *const parts[] = {"*ELEMENT, TYPE=C3D10, ELSET=REGION_M2147483647\n"
                                        "1,1,2,3,4,5,6,7,8,9,10\n",
                                        "*SURFACE, TYPE=ELEMENT, NAME=SURFACE_M2147483647\n1,S1\n"
                                        "*NSET",
                                        "*NSET, NSET=NODES_M2147483647\n1\n3\n2\n7\n6\n5\n"};
    meshio_mesh m, back;
    const char *name = file_name("inp");
    char *text;
    size_t i, size;
    memset(&m, 0, sizeof m);
    for (i = 0; i < 30; i++) xyz[i] = (double)(i * i % 7);
    m.xyz = xyz, m.num_vertices = 10;
    m.tets = tet, m.tet_tags = tag, m.num_tets = 1;
    m.triangles = triangle, m.triangle_tags = tag, m.num_triangles = 1;
    m.second_order = 1;
    CHECK(meshio_write(name, &m, NULL, NULL) == MESHIO_OK);
    text = load(name, &size);
    CHECK(text != NULL);
    if (text) text[size] = 0;
    for (i = 0; text && i < 3; i++) CHECK(strstr(text, parts[i]) != NULL);
    free(text);
    CHECK(meshio_read(name, MESHIO_FORMAT_AUTO, &back, NULL) == MESHIO_OK);
    CHECK(back.num_tets == 1 && back.tet_tags[0] == tag[0] && memcmp(back.tets, tet, 16) == 0);
    CHECK(back.num_triangles == 1 && back.triangle_tags[0] == tag[0]);
    CHECK(back.num_spare == 6 && back.spare && !back.spare[3] && back.spare[4] && back.spare[9]);
    meshio_free(&back);
    remove(name);
}

/* Writes an .inp file of three pairs of tetrahedra, one on each side of triangle 5i, 5i+1, 5i+2,
 * which is turned over in the pairs with a bit in turned. The first of a pair, element 2i+1, is
 * behind a triangle that is turned over. Checks the lines of the surface. */
static void check_inp_sides(const int32_t regions[6], int turned, const char *lines)
{
    static double xyz[45];
    uint32_t tets[24], triangles[9], i, k;
    int32_t tags[3] = {7, 7, 7}, tet_tags[6];
    const char *name = file_name("inp"), *at;
    char *text;
    size_t size;
    meshio_mesh m;
    memset(&m, 0, sizeof m);
    for (i = 0; i < 3; i++) {
        const uint32_t v = 5 * i, a = turned >> i & 1 ? v + 2 : v + 1;
        uint32_t *t = tets + 8 * i, *f = triangles + 3 * i;
        t[0] = v, t[1] = v + 1, t[2] = v + 2, t[3] = v + 3;
        t[4] = v, t[5] = v + 2, t[6] = v + 1, t[7] = v + 4;
        f[0] = v, f[1] = a, f[2] = 2 * v + 3 - a;
    }
    for (k = 0; k < 6; k++) tet_tags[k] = regions[k];
    m.xyz = xyz, m.num_vertices = 15;
    m.tets = tets, m.tet_tags = tet_tags, m.num_tets = 6;
    m.triangles = triangles, m.triangle_tags = tags, m.num_triangles = 3;
    CHECK(meshio_write(name, &m, NULL, NULL) == MESHIO_OK);
    text = load(name, &size);
    CHECK(text != NULL);
    if (text) text[size] = 0;
    at = text ? strstr(text, "NAME=SURFACE_7\n") : NULL;
    CHECK(at && strncmp(at + 15, lines, strlen(lines)) == 0 && at[15 + strlen(lines)] == '*');
    free(text);
    remove(name);
}

static void inp_surfaces_are_on_one_side(void)
{
    static const int32_t same[6] = {4, 4, 4, 4, 4, 4}, two[6] = {1, 2, 1, 2, 1, 2},
                         layers[6] = {9, 1, 9, 2, 9, 3}, other[6] = {1, 2, 1, 2, 3, 4};
    check_inp_sides(same, 0, "2,S1\n4,S1\n6,S1\n"); /* behind each */
    check_inp_sides(same, 2, "2,S1\n3,S1\n6,S1\n");
    check_inp_sides(two, 0, "2,S1\n4,S1\n6,S1\n"); /* behind most */
    check_inp_sides(two, 2, "2,S1\n4,S1\n6,S1\n");
    check_inp_sides(two, 6, "1,S1\n3,S1\n5,S1\n");
    check_inp_sides(layers, 7, "1,S1\n3,S1\n5,S1\n"); /* 9 is within layers 1 to 3 */
    check_inp_sides(layers, 6, "1,S1\n3,S1\n5,S1\n");
    check_inp_sides(other, 4, "2,S1\n4,S1\n5,S1\n"); /* the last is not beside region 2 */
}

/* Comments, continued lines, any case, sparse numbers, elements before nodes, sets without a number
 * in their name, an assembly with nodes of its own, cards and elements of no use. */
static void inp_is_read_as_others_write_it(void)
{
    static const char text[] =
        "*Heading\n a part\n** written by hand\n*Part, name=P\n"
        "*Element, type=C3D10M, elset=Steel\n 7, 10, 20, 30, 40,\n 50, 60, 70, 80,\n\t90, 100\n"
        "*ELEMENT,ELSET=Copper , TYPE = c3d4\r\n8,10,30,20,50\r\n"
        "*ELEMENT, TYPE=C3D4,\nELSET=STEEL\n9,10,20,30,60\n"
        "*ELEMENT, TYPE=S4R, ELSET=plate-12\n11,10,20,40,30\n"
        "*ELEMENT, TYPE=T3D2\n12,10,20\n"
        "*ELEMENT, TYPE=C3D8, ELSET=A_3\n13,10,20,30,40,50,60,\n70,80\n14,10,20,30,40,50,60,70,80\n"
        "*Nset, nset=ends, generate\n10, 20, 10\n*SURFACE, NAME=Loaded_5\n7, S1\nSTEEL, S2\n8, S4\n"
        "11, S1\n"
        "*Node\n10,0,0,0\n20,1.,,0\n30, ,1E0,\n 0\n40,0.,0.,1.d0\n50,.5\n60,1,1,1\n70,0\n80,0\n"
        "90,0\n100,0\n"
        "*End Part\n*Assembly, name=A\n*Instance, name=I, part=P\n5., 0., 0.\n*End Instance\n"
        "*Node\n1, 9., 9., 9.\n*Surface, name=S_6\n7, S2\n*End Assembly\n*Material, name=M\n"
        "*Elastic\n1, 0.3\n";
    meshio_mesh m;
    meshio_report report;
    CHECK(read_text(MESHIO_FORMAT_INP, text, &m, &report) == MESHIO_OK);
    if (report.message[0]) printf("%s\n", report.message);
    CHECK(m.num_vertices == 10 && m.num_tets == 3 && m.num_edges == 1 && m.num_other == 2);
    CHECK(m.num_solids == 2 && m.num_spare == 4); /* nodes 50 and 60 are corners of others */
    if (m.num_vertices == 10 && m.num_tets == 3) {
        static const uint32_t tets[12] = {0, 1, 2, 3, 0, 2, 1, 4, 0, 1, 2, 5};
        CHECK(memcmp(m.tets, tets, sizeof tets) == 0);
        CHECK(m.tet_tags[0] == 1 && m.tet_tags[1] == 2 && m.tet_tags[2] == 1);
        CHECK(m.xyz[3] == 6 && m.xyz[7] == 1 && m.xyz[8] == 0 && m.xyz[11] == 1 &&
              m.xyz[12] == 5.5);
    }
    CHECK(m.num_triangles == 6);
    if (m.num_triangles == 6) {
        static const uint32_t facets[12] = {0, 2, 1, 0, 1, 3, 0, 1, 5, 0, 4, 1};
        CHECK(m.triangle_tags[0] == 12 && m.triangle_tags[1] == 12);
        CHECK(m.triangle_tags[2] == 5 && m.triangle_tags[5] == 5);
        CHECK(memcmp(m.triangles + 6, facets, 12) == 0);
        CHECK(has_element(m.triangles, m.triangle_tags, 6, 3, facets + 3, 5));
        CHECK(has_element(m.triangles, m.triangle_tags, 6, 3, facets + 6, 5));
        CHECK(has_element(m.triangles, m.triangle_tags, 6, 3, facets + 9, 5));
    }
    meshio_free(&m);
}

#define NODES "*Node\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n"
#define TET "*Element, type=C3D4\n1, 1, 2, 3, 4\n"
#define CHECK_REFUSED(text, at)                                                                    \
    CHECK(read_text(MESHIO_FORMAT_INP, text, &m, &report) == MESHIO_ERROR_UNSUPPORTED &&           \
          report.line == (at))

/* Parts with numbers of their own, put where their instances are. */
static void inp_parts_have_their_places(void)
{
    meshio_mesh m;
    meshio_report report;
    CHECK(read_text(MESHIO_FORMAT_INP,
                    "*Heading\n*Part, name=A\n" NODES TET "*Surface, name=S-7\n1, S1\n*End Part\n"
                    "*Part, name=\"B 1\"\n" NODES TET "*End Part\n*Assembly, name=All\n"
                                                      "*Instance, name=A-1, part=A\n*End Instance\n"
                    "*Instance, name=B-1, part=\"B 1\"\n10., 0., 0.\n"
                    "10., 0., 0., 10., 0., 1., 90.\n*End Instance\n*Node\n1, 5, 5, 5\n"
                    "*Elset, elset=_E, internal, instance=B-1\n 1,\n"
                    "*Elset, elset=_E, instance=Other\n1\n*Surface, name=T-8\n_E, S2\n1, S3\n"
                    "*End Assembly\n",
                    &m, &report) == MESHIO_OK);
    if (report.message[0]) printf("%s\n", report.message);
    CHECK(m.num_vertices == 8 && m.num_tets == 2 && m.num_triangles == 2);
    if (m.num_vertices == 8 && m.num_tets == 2 && m.num_triangles == 2) {
        CHECK(m.tets[0] == 0 && m.tets[7] == 7 && m.tet_tags[0] == 1 && m.tet_tags[1] == 2);
        CHECK(m.triangle_tags[0] == 7 && m.triangle_tags[1] == 8 && m.triangles[0] == 0 &&
              m.triangles[3] == 4 && m.triangles[4] == 5 && m.triangles[5] == 7);
        /* (1 0 0), moved, turned */
        CHECK(fabs(m.xyz[15] - 10) < 1e-14 && fabs(m.xyz[16] - 1) < 1e-14);
        CHECK(fabs(m.xyz[18] - 9) < 1e-14 && fabs(m.xyz[19]) < 1e-14 && m.xyz[23] == 1);
    }
    meshio_free(&m);
    CHECK(read_text(MESHIO_FORMAT_INP, /* nodes in the instances */
                    "*Part, name=A\n*End Part\n*Assembly, name=All\n"
                    "*Instance, name=A-1, part=A\n" NODES TET
                    "*End Instance\n*Instance, name=A-2, part=A\n" NODES TET
                    "*End Instance\n*Node\n1, 9, 9, 9\n*End Assembly\n",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_vertices == 8 && m.num_tets == 2);
    if (m.num_tets == 2) CHECK(m.tets[4] == 4 && m.tet_tags[0] == 1 && m.tet_tags[1] == 2);
    meshio_free(&m);
    CHECK(live_blocks == 0);
}

/* The regions of sections; facets of sets. */
static void inp_sets_have_numbers(void)
{
    meshio_mesh m;
    CHECK(read_text(MESHIO_FORMAT_INP,
                    NODES "*Element, type=C3D4\n1, 1, 2, 3, 4\n2, 1, 3, 2, 4\n3, 1, 2, 3, 4\n"
                          "5, 1, 2, 3, 4\n"
                    "*Elset, elset=Steel, generate\n1, 3, 2\n*Elset, elset=Air\n2, Steel, 4=\n"
                    "*Solid Section, elset=Steel\n,\n"
                    "*Solid Section, elset=Air\n,\n*Surface, name=Out\nSteel, S4\nnone, S1\n",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_tets == 4 && m.num_triangles == 2);
    if (m.num_tets == 4 && m.num_triangles == 2)
        CHECK(m.tet_tags[0] == 1 && m.tet_tags[1] == 2 && m.tet_tags[2] == 1 &&
              m.tet_tags[3] == 0 && m.triangle_tags[1] == 3 && m.triangles[4] == 3);
    meshio_free(&m);
    CHECK(read_text(MESHIO_FORMAT_INP, /* sections in several parts; only one element has none */
                    "*Part, name=A\n" NODES TET "2, 1, 2, 4, 3\n*Elset, elset=MAT_7\n1\n"
                                                "*Solid Section, elset=MAT_7\n*End Part\n"
                    "*Part, name=B\n" NODES TET "2, 1, 2, 4, 3\n*Elset, elset=MAT_0\n1\n"
                                                "*Solid Section, elset=MAT_0\n"
                    "*Element, type=C3D4, elset=R_5\n3, 1, 2, 3, 4\n*Solid Section, elset=R_5\n"
                    "*Element, type=T3D2\n4, 1, 2\n*End Part\n",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_tets == 5 && m.num_edges == 1);
    if (m.num_tets == 5 && m.num_edges == 1)
        CHECK(m.tet_tags[0] == 7 && m.tet_tags[1] == 1 && m.tet_tags[2] == 0 &&
              m.tet_tags[3] == 2 && m.tet_tags[4] == 5 && m.edge_tags[0] == 2);
    meshio_free(&m);
    CHECK(read_text(MESHIO_FORMAT_INP, /* a number that is too large; zeros before a number */
                    NODES "*Element, type=C3D4, elset=S10000000005\n1, 1, 2, 3, 4\n"
                    "*Element, type=C3D4, elset=S000000000005\n2, 1, 2, 3, 4\n"
                    "*Element, type=C3D4, elset=S_M2147483648\n3, 1, 2, 3, 4\n"
                    "*Element, type=C3D4, elset=S2147483648\n4, 1, 2, 3, 4\n"
                    "*Element, type=C3D4, elset=S99999999999999999999999999\n5, 1, 2, 3, 4\n",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_tets == 5);
    if (m.num_tets == 5)
        CHECK(m.tet_tags[0] == 0 && m.tet_tags[1] == 5 && m.tet_tags[2] == INT32_MIN &&
              m.tet_tags[3] == 0 && m.tet_tags[4] == 0);
    meshio_free(&m);
    CHECK(live_blocks == 0);
}

static void inp_elements_have_kinds(void)
{
    meshio_mesh m;
    CHECK(read_text(MESHIO_FORMAT_INP,
                    NODES "5, 1, 1\n*Element, type=R3D3, elset=a9\n1, 1, 2, 3\n"
                          "*Element, type=STRI65\n2, 1, 2, 3, 4, 4, 4\n"
                    "*Element, type=S8R5\n3, 1, 2, 5, 3, 4, 4, 4, 4\n*Element, type=CAX4\n"
                    "4, 1, 2, 5, 3\n*Element, type=B32H\n5, 1, 2, 3\n"
                    "*Element, type=B31\n6, 2, 3\n*Element, type=AC3D10\n"
                    "7, 1, 2, 3, 4, 5, 5, 5, 5, 5, 5\n*Element, type=SC6R\n8, 1, 2, 3, 4, 5, 5\n"
                    "*Element, type=C3D6\n9, 1, 2, 3, 4, 5, 5\n*Element, type=SPRING2\n10, 1, 2\n",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 6 && m.triangle_tags[0] == 9 && m.num_edges == 2 && m.num_tets == 1 &&
          m.num_other == 3);
    meshio_free(&m);
    CHECK(live_blocks == 0);
}

static void inp_lines_of_three_nodes_have_the_second_in_the_middle(void)
{
    meshio_mesh m;
    CHECK(read_text(MESHIO_FORMAT_INP, "*Node\n1, 0, 0, 0\n2, 1, 0, 0\n3, 2, 0, 0\n4, 0, 1, 0\n"
                    "5, 0, 2, 0\n*Element, type=B32\n1, 1, 2, 3\n*Element, type=T3D3\n2, 1, 4, 5\n",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_edges == 2);
    if (m.num_edges == 2)
        CHECK(m.edges[0] == 0 && m.edges[1] == 2 && m.edges[2] == 0 && m.edges[3] == 4);
    meshio_free(&m);
    CHECK(live_blocks == 0);
}

static void inp_refuses_what_it_does_not_know(void)
{
    meshio_mesh m;
    meshio_report report;
    char *many;
    size_t n;
    int k;
    CHECK_REFUSED("*Part, name=A\n" NODES "*End Part\n*Assembly, name=B\n"
                                          "*Instance, name=A-1, part=A\n*End Instance\n"
                  "*Instance, name=A-2, part=A\n1, 0, 0\n*End Instance\n", 11);
    CHECK_REFUSED(NODES "*NGEN\n1, 2, 1\n", 6);
    CHECK_REFUSED(NODES "*Elcopy, element shift=1\n", 6);
    CHECK_REFUSED("*SYSTEM\n1, 0, 0\n" NODES, 1);
    CHECK_REFUSED("*NODE, INPUT=nodes.txt\n", 1);
    CHECK_REFUSED("*NODE, SYSTEM=C\n1, 1, 90, 0\n", 1);
    many = (char *)malloc(40000); /* a set in more surfaces than any file has */
    n = (size_t)snprintf(many, 40000, "%s", NODES TET "*Elset, elset=E\n1\n*Surface, name=S\n");
    for (k = 0; k < 1100; k++) n += (size_t)snprintf(many + n, 40000 - n, "E, S%d\n", k % 4 + 1);
    CHECK(read_text(MESHIO_FORMAT_INP, many, &m, &report) == MESHIO_ERROR_TOO_LARGE);
    free(many);
    CHECK(live_blocks == 0);
}
#undef NODES
#undef TET
#undef CHECK_REFUSED

static void surface_formats_keep_the_triangles(void)
{
    meshio_mesh m = sample(), back;
    const char *name;
    meshio_write_options options;
    memset(&options, 0, sizeof options);
    name = file_name("off");
    CHECK(meshio_write(name, &m, NULL, NULL) == MESHIO_OK);
    CHECK(meshio_read(name, MESHIO_FORMAT_AUTO, &back, NULL) == MESHIO_OK);
    CHECK(back.num_triangles == 6 && same_bits(back.xyz, m.xyz, 18));
    CHECK(memcmp(back.triangles, m.triangles, sizeof sample_triangles) == 0);
    meshio_free(&back);
    remove(name);
    name = file_name("obj");
    CHECK(meshio_write(name, &m, NULL, NULL) == MESHIO_OK);
    CHECK(meshio_read(name, MESHIO_FORMAT_AUTO, &back, NULL) == MESHIO_OK);
    CHECK(back.num_triangles == 6 && same_bits(back.xyz, m.xyz, 18));
    CHECK(memcmp(back.triangles, m.triangles, sizeof sample_triangles) == 0);
    meshio_free(&back);
    remove(name);
    name = file_name("stl");
    options.ascii = 1; /* text keeps doubles; corners are welded in order of first appearance */
    CHECK(meshio_write(name, &m, &options, NULL) == MESHIO_OK);
    CHECK(meshio_read(name, MESHIO_FORMAT_AUTO, &back, NULL) == MESHIO_OK);
    CHECK(back.num_triangles == 6 && back.num_vertices == 6 && back.num_corners == 18);
    CHECK(back.triangles[0] == 0 && back.triangles[1] == 1 && back.triangles[2] == 2);
    CHECK(same_bits(back.xyz + 3, m.xyz + 6, 3) && strcmp(back.name, "sample") == 0);
    meshio_free(&back);
    m.num_triangles = 4; /* what floats can hold */
    CHECK(meshio_write(name, &m, NULL, NULL) == MESHIO_OK);
    CHECK(meshio_read(name, MESHIO_FORMAT_AUTO, &back, NULL) == MESHIO_OK);
    CHECK(back.num_triangles == 4 && back.xyz[3] == (double)0.1f);
    meshio_free(&back);
    remove(name);
}

/* Whatever the machine's byte order is. */
static void stl_is_written_in_little_endian_order(void)
{
    static double xyz[9] = {0, 0, 0, 1, 0, 0, 0, 2, 0};
    static uint32_t triangle[3] = {0, 1, 2};
    static const unsigned char expected[54] = {
        1, 0, 0, 0, /* one triangle; its normal, its corners, two zeros */
        0, 0, 0, 0, 0, 0,    0,    0, 0, 0, 0x80, 0x3F, 0, 0, 0, 0, 0, 0, 0, 0,    0, 0, 0, 0,
        0, 0, 0x80, 0x3F, 0, 0, 0, 0, 0, 0, 0, 0,    0, 0, 0, 0, 0, 0, 0, 0x40, 0, 0, 0, 0, 0, 0};
    meshio_mesh m;
    char *bytes;
    size_t size;
    memset(&m, 0, sizeof m);
    m.xyz = xyz, m.num_vertices = 3;
    m.triangles = triangle, m.num_triangles = 1;
    CHECK(meshio_write(file_name("stl"), &m, NULL, NULL) == MESHIO_OK);
    bytes = load(file_name("stl"), &size);
    CHECK(bytes && size == 134 && memcmp(bytes + 80, expected, 54) == 0);
    free(bytes);
    remove(file_name("stl"));
}

static void binary_stl_has_no_infinite_coordinates(void)
{
    static double xyz[9] = {0, 0, 0, 1e39, 0, 0, 0, 2, 0};
    static uint32_t triangle[3] = {0, 1, 2};
    meshio_write_options options;
    meshio_mesh m, back;
    FILE *f;
    memset(&m, 0, sizeof m);
    memset(&options, 0, sizeof options);
    m.xyz = xyz, m.num_vertices = 3;
    m.triangles = triangle, m.num_triangles = 1;
    CHECK(meshio_write(file_name("stl"), &m, NULL, NULL) == MESHIO_ERROR_TOO_LARGE);
    f = fopen(file_name("stl"), "rb");
    CHECK(!f);
    if (f) fclose(f);
    options.ascii = 1;
    CHECK(meshio_write(file_name("stl"), &m, &options, NULL) == MESHIO_OK);
    CHECK(meshio_read(file_name("stl"), MESHIO_FORMAT_AUTO, &back, NULL) == MESHIO_OK);
    CHECK(back.num_vertices == 3 && back.xyz[3] == 1e39);
    meshio_free(&back);
    remove(file_name("stl"));
}

static void points_are_read_raw_and_as_text(void)
{
    meshio_mesh m;
    const char *name = file_name("bin");
    FILE *f = fopen(name, "wb");
    double d[6] = {1, 2, 3, 0.1, -0.0, 1e300};
    int swap = !meshio__little_endian();
    CHECK(f != NULL);
    if (!f || swap) return;
    fwrite(d, 1, sizeof d, f);
    fclose(f);
    CHECK(meshio_read(name, MESHIO_FORMAT_AUTO, &m, NULL) == MESHIO_OK);
    CHECK(m.num_vertices == 2 && same_bits(m.xyz, d, 6));
    meshio_free(&m);
    remove(name);
    CHECK(meshio_read_memory(d, 25, MESHIO_FORMAT_BIN, &m, NULL) == MESHIO_ERROR_TRUNCATED);
    CHECK(read_text(MESHIO_FORMAT_XYZ, "# c\n1 2 3\n\n 4\t5 6 255 0 0\r\n7 8 9", &m, NULL) ==
          MESHIO_OK);
    CHECK(m.num_vertices == 3 && m.xyz[5] == 6 && m.xyz[8] == 9);
    meshio_free(&m);
    CHECK(read_text(MESHIO_FORMAT_XYZ, "2\n1 2 3\n4 5 6\n", &m, NULL) == MESHIO_OK);
    CHECK(m.num_vertices == 2);
    meshio_free(&m);
    CHECK(read_text(MESHIO_FORMAT_XYZ, "", &m, NULL) == MESHIO_OK && m.num_vertices == 0);
    CHECK(read_text(MESHIO_FORMAT_XYZ, "2\n1 2 3\n", &m, NULL) == MESHIO_ERROR_COUNT);
    CHECK(read_text(MESHIO_FORMAT_XYZ, "1 2\n", &m, NULL) == MESHIO_ERROR_SYNTAX);
    CHECK(read_text(MESHIO_FORMAT_XYZ, "1 2 3\nfoo", &m, NULL) == MESHIO_ERROR_SYNTAX);
}

/* ---- odd but right files ---- */

static void check_tetrahedron(meshio_format format, const char *text)
{
    meshio_mesh m;
    meshio_report report;
    CHECK(read_text(format, text, &m, &report) == MESHIO_OK);
    if (report.message[0]) printf("%s\nin\n%s\n", report.message, text);
    CHECK(m.num_vertices == 4 && m.num_triangles == 4);
    if (m.num_vertices == 4 && m.num_triangles == 4) {
        CHECK(m.xyz[11] == 1 && m.xyz[3] == 1 && m.xyz[7] == 1);
        CHECK(m.triangles[0] == 0 && m.triangles[1] == 2 && m.triangles[2] == 1);
        CHECK(m.triangles[9] == 0 && m.triangles[10] == 3 && m.triangles[11] == 2);
    }
    meshio_free(&m);
}

static void off_comes_in_many_layouts(void)
{
    meshio_mesh m;
    check_tetrahedron(
        MESHIO_FORMAT_OFF,
        "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
    check_tetrahedron(
        MESHIO_FORMAT_OFF,
        "\xEF\xBB\xBFOFF\r\n4 4 6\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n0 0 1\r\n3 0 2 1\r\n3 0 1 3\r\n"
        "3 1 2 3\r\n3 0 3 2");
    check_tetrahedron(MESHIO_FORMAT_OFF,
                      "OFF 4 4 6 0 0 0 1 0 0 0 1 0 0 0 1 3 0 2 1 3 0 1 3 3 1 2 3 3 0 3 2");
    check_tetrahedron(
        MESHIO_FORMAT_OFF,
        "# a\nOFF # b\n\n4\t4 6\n# c\n0 0 0#d\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1 255 0 0\n3 0 1 3 0.5\n"
        "3 1 2 3\n\n3 0 3 2 # end");
    check_tetrahedron(
        MESHIO_FORMAT_OFF,
        "COFF 4 4 6\n0 0 0 1 1 1 1\n1 0 0 1 1 1 1\n0 1 0 1 1 1 1\n0 0 1 1 1 1 1\n3 0 2 1\n3 0 1 3\n"
        "3 1 2 3\n3 0 3 2\n");
    CHECK(read_text(MESHIO_FORMAT_OFF,
                    "OFF\n5 1 0\n0 0 0\n1 0 0\n1 1 0\n.5 2 0\n0 1 0\n5 0 1 2 3 4\n", &m,
                    NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 3 && m.triangles[6] == 0 && m.triangles[7] == 3 &&
          m.triangles[8] == 4);
    meshio_free(&m);
    check_tetrahedron(
        MESHIO_FORMAT_OFF,
        "# no header\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
    CHECK(read_text(MESHIO_FORMAT_OFF, "OFF 0 0 0", &m, NULL) == MESHIO_OK && m.num_vertices == 0);
    check_tetrahedron( /* three numbers of colour, comments; normals; what no header tells */
        MESHIO_FORMAT_OFF,
        "COFF\n4 4 0\n\n0 0 0 .9 0 0 #red\n1 0 0 0 0 .9   # blue\n0 1 0 9 9 9#\n0 0 1 1 1 1\n#\n"
        "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
    check_tetrahedron(
        MESHIO_FORMAT_OFF,
        "STCNOFF\r\n4 4 0\r\n0 0 0 0 0 1 255 255 255 255 .5 .5\r\n1 0 0 0 0 1\r\n0 1 0 red\r\n"
        "0 0 1\r\n3 0 2 1\r\n3 0 1 3\r\n3 1 2 3\r\n3 0 3 2");
    check_tetrahedron(MESHIO_FORMAT_OFF,
                      "OFF4 4 0\n0 0 0 1 1 1\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n"
                      "3 0 3 2\n");
    check_tetrahedron(
        /* lines that are not one vertex each: four numbers of colour, as claimed */
        MESHIO_FORMAT_OFF,
        "COFF 4 4 0\n0 0 0 1 1 1 1 1 0 0 1 1 1 1\n0 1 0 1 1 1 1 0 0 1 1 1 1 1\n3 0 2 1\n3 0 1 3\n"
        "3 1 2 3\n3 0 3 2\n");
    check_tetrahedron(MESHIO_FORMAT_OFF, "OFF\n4 4 0\n0 0 0 1 0 0\n0 1 0 0 0 1\n3 0 2 1\n3 0 1 3\n"
                                         "3 1 2 3\n3 0 3 2\n");
    /* no number of edges; it on a line of its own */
    check_tetrahedron(MESHIO_FORMAT_OFF, "OFF\n4 4 # none\n\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n"
                                         "3 0 1 3\n3 1 2 3\n3 0 3 2\n");
    check_tetrahedron(MESHIO_FORMAT_OFF, "OFF\n4 4\n6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n"
                                         "3 0 1 3\n3 1 2 3\n3 0 3 2\n");
    check_tetrahedron(MESHIO_FORMAT_OFF, "OFF\n4\n4\n0\n0\n0\n0\n1\n0\n0\n0\n1\n0\n0\n0\n1\n"
                                         "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
    /* a line with fewer numbers than a vertex has; two lines for a vertex; two for a face */
    check_tetrahedron(MESHIO_FORMAT_OFF, "OFF\n4 4 0\n0 0 0 1\n0 0\n0 1 0\n0 0 1\n3 0 2 1\n"
                                         "3 0 1 3\n3 1 2 3\n3 0 3 2\n");
    check_tetrahedron(MESHIO_FORMAT_OFF, "STOFF\n4 4 0\n0 0 0\n1 1\n1 0 0\n1 1\n0 1 0\n1 1\n"
                                         "0 0 1\n1 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
    check_tetrahedron(MESHIO_FORMAT_OFF, "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3\n0 2 1\n"
                                         "3 0 1\n3\n3 1 2 3 9\n3 0 3 2 9\n");
}

/* Lines may end with CR alone, also those of comments; errors have the right line then, too. */
static void lines_may_end_with_a_carriage_return(void)
{
    static const struct {
        meshio_format format;
        const char *text;
    } files[] = {
        {MESHIO_FORMAT_OFF,
         "OFF\r# four\r4 4 6\r0 0 0 # a\r1 0 0 9 9 9\r0 1 0\r0 0 1\r3 0 2 1\r3 0 1 3 9 9 9\r"
         "3 1 2 3\r3 0 3 2"},
        {MESHIO_FORMAT_OBJ, "# four\rv 0 0 0\rv 1 0 0\rv 0 1 0\rv 0 0 1\rf 1 3 2\rf 1 2 4\r"
                            "f 2 3 4\rf 1 4 3\r"},
        {MESHIO_FORMAT_SMESH, "# four\r4 3 0 0\r0 0 0 0\r1 1 0 0\r2 0 1 0\r3 0 0 1\r# four\r4 0\r"
                              "3 0 2 1\r3 0 1 3\r3 1 2 3\r3 0 3 2\r# none\r0\r0\r"},
        {MESHIO_FORMAT_MEDIT,
         "MeshVersionFormatted 2\rDimension 3\r# four\rVertices\r4\r0 0 0 0\r1 0 0 0\r0 1 0 0\r"
         "0 0 1 0\rTriangles\r4\r1 3 2 0\r1 2 4 0\r2 3 4 0\r1 4 3 0\rEnd\r"}};
    static const char *const ends[] = {"\r", "\n", "\r\n"};
    char text[999];
    size_t i, k, n;
    meshio_mesh m;
    meshio_report report;
    for (i = 0; i < sizeof files / sizeof files[0]; i++)
        check_tetrahedron(files[i].format, files[i].text);
    for (i = 0; i < 3; i++) {
        static const char *const lines[] = {"OFF", "# c", "1 1 0", "0 0 0", "", "3 0 0 7", "x"};
        for (n = k = 0; k < sizeof lines / sizeof lines[0]; k++)
            n += (size_t)snprintf(text + n, sizeof text - n, "%s%s", lines[k], ends[i]);
        CHECK(read_text(MESHIO_FORMAT_OFF, text, &m, &report) == MESHIO_ERROR_INDEX);
        CHECK(report.line == 6);
    }
    CHECK(read_text(MESHIO_FORMAT_MSH,
                    "$MeshFormat\r2.2 0 8\r$EndMeshFormat\r$PhysicalNames\r2\r2 1 \"a\"\r"
                    "3 1 \"b\"\r$EndPhysicalNames\r$Nodes\r0\r$EndNodes\r",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_names == 2 && strcmp(m.names[1].text, "b") == 0);
    meshio_free(&m);
}

/* Elements of PLY files have a line each, but not always. */
static void ply_text_comes_in_many_layouts(void)
{
    static const char *const bodies[] = {
        "0 0 0 1 0 0 0 1 0 0 0 1 3 0 2 1 3 0 1 3 3 1 2 3 3 0 3 2",
        "0 0 0 1 0 0\n0 1 0 0 0 1\n3 0 2 1 3 0 1 3\n3 1 2 3 3 0 3 2\n",
        "0\n0\n0\n1\n0\n0\n0\n1\n0\n0\n0\n1\n"
        "3\n0\n2\n1\n3\n0\n1\n3\n3\n1\n2\n3\n3\n0\n3\n2\n",
        "0 0 0 1 0 0 0 1 0 0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n",
        "0 0 0\r\n\r\n1 0 0\t\r\n0 1 0 \r\n0 0 1\r\n"
        "3\r\n0 2 1\r\n3\r\n0 1 3\r\n3\r\n1 2 3\r\n3\r\n0 3 2"};
    char text[400];
    size_t i;
    meshio_mesh m;
    for (i = 0; i < sizeof bodies / sizeof bodies[0]; i++) {
        snprintf(text, sizeof text,
                 "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                 "property float z\nelement face 4\nproperty list uchar int vertex_indices\n"
                 "end_header\n%s",
                 bodies[i]);
        check_tetrahedron(MESHIO_FORMAT_PLY, text);
    }
    check_tetrahedron(
        MESHIO_FORMAT_PLY, /* one line of vertices of as many numbers as faces */
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nproperty float w\nelement face 4\n"
        "property list uchar int vertex_indices\nend_header\n0 0 0 9 1 0 0 9 0 1 0 9 0 0 1 9\n"
        "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
    CHECK(read_text(MESHIO_FORMAT_PLY, /* every other line could be a face */
                    PLY "3" XYZ
                    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
                    "0 0\n0\n1 0\n0\n0 1\n0\n3 0\n1 2\n3 0\n1 2\n",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 2 && m.triangles[4] == 1);
    meshio_free(&m);
}

/* Where elements have their lines, a line that has fewer numbers is named, although the next lines
 * have numbers enough; in PLY, also one that has more. */
static void incomplete_lines_are_named(void)
{
    static const struct {
        meshio_format format;
        const char *text;
        uint64_t line;
    } bad[] = {
#define FACES "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"
        {MESHIO_FORMAT_OFF, "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1\n0 0 1\n" FACES, 5},
        {MESHIO_FORMAT_OFF, "OFF\n4 4 0\n0 0\n1 0 0\n0 1 0\n0 0 1\n" FACES, 3},
        {MESHIO_FORMAT_OFF, "OFF 4 4\n0 0 0\n1 0 0 # ab\n0 1 0\n0 1 # 2\n" FACES "# end\n", 5},
        {MESHIO_FORMAT_OFF, "OFF\n4 4 0\n0 0 0\n1 0 0\n\n0\n0 0\n" FACES, 6},
        {MESHIO_FORMAT_OFF,
         "COFF\n4 4 0\n0 0 0 1 1 .5\n1 0 0 1 1 .5\n0 1\n0 0 1 1 1 .5\n" FACES, 5},
        {MESHIO_FORMAT_OFF,
         "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1\n3 1 2 3\n3 0 3 2\n", 8},
#define ASCII                                                                                      \
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"                \
    "property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
        {MESHIO_FORMAT_PLY, ASCII "0 0 0\n1 0 0\n0 1\n0 0 1\n" FACES, 12},
        {MESHIO_FORMAT_PLY, ASCII "0 0\n1 0 0\n0 1 0\n0 0 1\n" FACES, 10},
        {MESHIO_FORMAT_PLY, ASCII "0 0 0 0\n1 0 0\n0 1 0\n0 0 1\n" FACES, 10},
        {MESHIO_FORMAT_PLY, ASCII "0 0 0\n1 0 0\n0 1 0\n0 0 1 1\n" FACES, 13},
        {MESHIO_FORMAT_PLY, ASCII "0 0 0\r1 0 0\r0 1\r0 0 1\r" FACES, 12},
        {MESHIO_FORMAT_PLY,
         ASCII "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1\n3 1 2 3\n3 0 3 2\n", 15},
        {MESHIO_FORMAT_PLY,
         ASCII "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3 3\n3 1 2 3\n3 0 3 2\n", 15},
        {MESHIO_FORMAT_PLY,
         ASCII "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0\n4 0 1 2 3\n3 0 3 2\n", 15},
        {MESHIO_FORMAT_PLY,
         ASCII "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 9\n3 1 2\n3 0 3 2\n", 15},
#undef ASCII
#undef FACES
        {MESHIO_FORMAT_POLY,
         "3 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1\n4 1\n1\n3 1 2 3\n1\n3 1 3 2\n0\n0\n", 4},
        {MESHIO_FORMAT_NODE, "3 3 0 1\n0 0 0 0 0\n1 1 0\n 0\n2 0 1 0 0\n", 3},
    };
    size_t i;
    for (i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        meshio_mesh m;
        meshio_report report;
        CHECK(read_text(bad[i].format, bad[i].text, &m, &report) != MESHIO_OK);
        if (report.line != bad[i].line) printf("case %d: %s\n", (int)i, report.message);
        CHECK(report.line == bad[i].line);
        meshio_free(&m);
    }
}

static void obj_indices_come_in_many_forms(void)
{
    meshio_mesh m;
    check_tetrahedron(MESHIO_FORMAT_OBJ,
                      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
    check_tetrahedron(
        MESHIO_FORMAT_OBJ,
        "o part\nv 0 0 0 1\nvn 0 0 1\nvt 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\ng a\nusemtl x\ns off\n"
        "f 1/1/1 3//1 -3\nf 1/1 2 4\nf 2 \\\n3\\\n 4\nf -4//-1 -1 -2 # c");
    check_tetrahedron(
        MESHIO_FORMAT_OBJ,
        "f 1 3 2\nv 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nv 0 0 1\r\nf 1 2 4\nf 2 3 4\nf 1 4 3");
    CHECK(read_text(MESHIO_FORMAT_OBJ,
                    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\ng a\nf 1 2 3\ng b\nf 1 2 4\nl 1 2\n", &m,
                    NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 2 && m.triangle_tags[0] == 1 && m.triangle_tags[1] == 2 &&
          m.num_other == 1);
    meshio_free(&m);
}

static void ply_elements_come_in_any_order(void)
{
    meshio_mesh m;
    check_tetrahedron(
        MESHIO_FORMAT_PLY,
        "ply\nformat ascii 1.0\ncomment x\nelement vertex 4\nproperty uchar red\nproperty float z\n"
        "property float y\nproperty float x\nelement face 4\nproperty list uchar uchar junk\n"
        "property list uchar int vertex_index\nend_header\n9 0 0 0\n9 0 0 1\n9 0 1 0\n9 1 0 0\n"
        "0 3 0 2 1\n1 5 3 0 1 3\n0 3 1 2 3\n2 1 1 3 0 3 2\n");
    check_tetrahedron(
        MESHIO_FORMAT_PLY,
        "ply\nformat ascii 1.0\nelement face 4\nproperty list uchar int vertex_index\n"
        "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
        "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n");
    CHECK(read_text(MESHIO_FORMAT_PLY,
                    "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\n"
                    "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                    "end_header\n3 0 2 3\n0 0 0\n1 0 0\n0 1 0\n",
                    &m, NULL) == MESHIO_ERROR_INDEX);
    CHECK(
        read_text(
            MESHIO_FORMAT_PLY,
            "ply\r\nformat ascii 1.0\r\nelement vertex 0\r\nproperty float x\r\n"
            "property float y\r\n"
            "property float z\r\nend_header\r\n",
            &m, NULL) == MESHIO_OK);
    meshio_free(&m);
}

static size_t put_text(unsigned char *p, size_t n, const char *text)
{
    memcpy(p + n, text, strlen(text));
    return n + strlen(text);
}

/* After lines that end with CR alone, binary data may begin with a line feed. */
static void ply_data_may_begin_with_a_line_feed(void)
{
    static const char *const ends[3] = {"\r", "\n", "\r\n"};
    static const unsigned char first[4] = {'\n', 0, 0, 0};
    unsigned char b[400];
    double x[3] = {0, 0, 0};
    meshio_mesh m;
    int k;
    for (k = 0; k < 3; k++) {
        size_t n = 0, i;
        static const char *const lines[] = {"ply", "format binary_little_endian 1.0",
                                            "element vertex 1", "property int id",
                                            "property double x", "property double y",
                                            "property double z", "end_header"};
        for (i = 0; i < sizeof lines / sizeof lines[0]; i++) {
            n = put_text(b, n, lines[i]);
            n = put_text(b, n, ends[k]);
        }
        memcpy(b + n, first, sizeof first);
        memcpy(b + n + 4, x, sizeof x);
        CHECK(meshio_read_memory(b, n + 28, MESHIO_FORMAT_PLY, &m, NULL) == MESHIO_OK);
        CHECK(m.num_vertices == 1 && m.xyz[0] == 0 && m.xyz[1] == 0 && m.xyz[2] == 0);
        meshio_free(&m);
        CHECK(meshio_read_memory(b, n + 27, MESHIO_FORMAT_PLY, &m, NULL) != MESHIO_OK);
    }
}

/* What follows the faces of a PLY file, text or binary, may be anything but a face. */
static void ply_may_go_on(void)
{
    static const char header[] =
        "ply\nformat %s 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty uchar red\n"
        "property list uchar uchar vertex_indices\nend_header\n%s";
    static const unsigned char faces[] = {9, 3, 0, 1, 2, 9, 3, 0, 2, 1};
    static const struct {
        const char *bytes;
        size_t size;
    } rest[] = {{"\n", 1},           {"\r\n\r\n", 4},   {"\0\0\0\0\0\0", 6}, {"\x09\x03\0\x01", 4},
                {"\x09\x03\0\1\3", 5}, {"\x09\2\0\1", 4}, {"      \x1a", 7},   {"bye", 3}};
    const float xyz[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    unsigned char b[400];
    meshio_mesh m;
    meshio_report report;
    size_t n, i;
    n = (size_t)snprintf((char *)b, sizeof b, header,
                         *(const char *)&xyz[3] ? "binary_big_endian" : "binary_little_endian", "");
    memcpy(b + n, xyz, sizeof xyz);
    memcpy(b + n + sizeof xyz, faces, 10);
    n += sizeof xyz + 5;
    CHECK(meshio_read_memory(b, n, MESHIO_FORMAT_PLY, &m, &report) == MESHIO_OK);
    meshio_free(&m);
    CHECK(meshio_read_memory(b, n + 5, MESHIO_FORMAT_PLY, &m, &report) == MESHIO_ERROR_COUNT);
    CHECK(report.offset == n);
    for (i = 0; i < sizeof rest / sizeof rest[0]; i++) {
        memcpy(b + n, rest[i].bytes, rest[i].size);
        CHECK(meshio_read_memory(b, n + rest[i].size, MESHIO_FORMAT_PLY, &m, &report) == MESHIO_OK);
        CHECK(m.num_triangles == 1 && report.message[0] == 0);
        meshio_free(&m);
    }
    snprintf((char *)b, sizeof b, header, "ascii", "0 0 0\n1 0 0\n0 1 0\n9 3 0 1 2\n9 3 0 2 1\n");
    CHECK(read_text(MESHIO_FORMAT_PLY, (const char *)b, &m, &report) == MESHIO_ERROR_COUNT);
    CHECK(report.line == 15);
    snprintf((char *)b, sizeof b, header, "ascii", "0 0 0\n1 0 0\n0 1 0\n9 3 0 1 2\n9 3 0 2 3\n");
    CHECK(read_text(MESHIO_FORMAT_PLY, (const char *)b, &m, &report) == MESHIO_OK);
    meshio_free(&m);
}

/* Faces of fewer than three corners are no triangles, but they are counted. */
static void thin_faces_are_counted(void)
{
    static const struct {
        meshio_format format;
        const char *text;
    } files[] = {
        {MESHIO_FORMAT_OFF, "OFF\n3 4 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n3 0 1 2\n1 2\n0\n"},
        {MESHIO_FORMAT_OBJ, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\nf 1 2 3\nf 3/1\nf -1//2 1//3\n"},
        {MESHIO_FORMAT_PLY,
         "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
         "property float z\nelement tristrips 1\nproperty list int int vertex_index\n"
         "element face 3\nproperty list uchar int vertex_indices\nend_header\n"
         "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n2 0 1\n3 0 1 2\n0\n"},
        {MESHIO_FORMAT_VTK,
         "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n"
         "0 0 0 1 0 0 0 1 0\nPOLYGONS 3 9\n2 0 1\n3 0 1 2\n1 2\nTRIANGLE_STRIPS 1 3\n2 0 1\n"}};
    size_t i;
    for (i = 0; i < sizeof files / sizeof files[0]; i++) {
        meshio_mesh m;
        CHECK(read_text(files[i].format, files[i].text, &m, NULL) == MESHIO_OK);
        CHECK(m.num_triangles == 1 && m.num_thin == 3 && m.num_other == 3 && m.num_solids == 0);
        meshio_free(&m);
    }
}

static void ply_strips_are_triangles(void)
{
    meshio_mesh m;
    check_tetrahedron(
        MESHIO_FORMAT_PLY,
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\n"
        "element edge 2\nproperty int vertex1\nproperty int vertex2\n"
        "element tristrips 2\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n"
        "0 1 0\n0 0 1\n"
        "0 1\n1 2\n7 0 2 1 -1 0 1 3\n7 1 2 3 -1 0 3 2\n");
    CHECK(
        read_text(
            MESHIO_FORMAT_PLY,
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
            "property float z\n"
            "element edge 1\nproperty int vertex1\nproperty int vertex2\n"
            "element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n"
            "0 1 0\n1 1 0\n"
            "0 1\n4 0 1 2 3\n",
            &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 2 && m.num_other == 1 && m.triangles[3] == 1 && m.triangles[4] == 3 &&
          m.triangles[5] == 2);
    meshio_free(&m);
}

static void medit_keywords_come_in_any_order(void)
{
    meshio_mesh m;
    check_tetrahedron(
        MESHIO_FORMAT_MEDIT,
        "MeshVersionFormatted 1\n# c\nDimension\n3\nVertices 4\n0 0 0 1\n1 0 0 2\n0 1 0 3\n"
        "0 0 1 4\nRidges 1\n1\n"
        "Normals\n1\n0 0.5 -1e3\nTriangles\n4\n1 3 2 5\n1 2 4 5\n2 3 4 5\n1 4 3 5\nEnd\n");
    CHECK(
        read_text(
            MESHIO_FORMAT_MEDIT,
            "MeshVersionFormatted 2 Dimension 3 Vertices 8 0 0 0 0 1 0 0 0 1 1 0 0 0 1 0 0 0 0 1 0 "
            "1 0 1 0 1 1 1 0 0 1 1 0 "
            "Quadrilaterals 1 1 2 3 4 9 Hexahedra 1 1 2 3 4 5 6 7 8 0 Edges 1 1 2 6",
            &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 2 && m.triangle_tags[1] == 9 && m.num_other == 1 && m.num_edges == 1 &&
          m.edge_tags[0] == 6);
    meshio_free(&m);
}

/* Elements of second order, under their own names and as Gmsh writes them, and in binary. */
static void medit_curved_elements_are_their_corners(void)
{
    static const char start[] =
        "MeshVersionFormatted 2\nDimension 3\nVertices\n10\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
        ".5 0 0 0\n.5 .5 0 0\n0 .5 0 0\n0 0 .5 0\n0 .5 .5 0\n.5 0 .5 0\n";
    static const char *const files[] = {
        "EdgesP2\n1\n1 2 5 7\nTrianglesP2 1\n1 2 3 5 6 7 8\n"
        "TetrahedraP2 1 1 2 3 4 5 6 7 8 9 10 9 End",
        "Edges\n1\n 1 2 5 7\nTriangles\n1\n1 2 3 5 6 7 8 \nTetrahedra\n1\n1 2 3 4 5 6 7 8 9 10 9\n"
        "End"};
    static const int32_t binary[] = {1, 2, 3, 20, 3, 4, 116, 3, 24, 156,
                                     1, 1, 2, 3,  1, 2, 3,   8, 54, 0};
    unsigned char bytes[256];
    char text[512];
    meshio_mesh m;
    size_t i;
    for (i = 0; i < 2; i++) {
        snprintf(text, sizeof text, "%s%s", start, files[i]);
        CHECK(read_text(MESHIO_FORMAT_MEDIT, text, &m, NULL) == MESHIO_OK);
        CHECK(m.num_edges == 1 && m.num_triangles == 1 && m.num_tets == 1);
        if (m.num_edges == 1 && m.num_triangles == 1 && m.num_tets == 1)
            CHECK(m.edge_tags[0] == 7 && m.triangle_tags[0] == 8 && m.tet_tags[0] == 9 &&
                  m.edges[1] == 1 && m.triangles[2] == 2 && m.tets[3] == 3);
        CHECK(m.num_spare == 6 && m.spare && !m.spare[3] && m.spare[4] && m.spare[9]);
        meshio_free(&m);
    }
    memset(bytes, 0, sizeof bytes);
    memcpy(bytes, binary, 32);            /* up to the number of vertices, 3 of 28 bytes */
    memcpy(bytes + 116, binary + 8, 48);  /* TrianglesP2 */
    CHECK(meshio_read_memory(bytes, 164, MESHIO_FORMAT_MEDIT_BINARY, &m, NULL) == MESHIO_OK);
    CHECK(m.num_vertices == 3 && m.num_triangles == 1 && m.triangles[2] == 2 &&
          m.triangle_tags[0] == 8);
    meshio_free(&m);
}

/* As many numbers on the first line as an entry of second order has. */
static void medit_lines_may_end_anywhere(void)
{
#define START                                                                                      \
    "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 1 0\n"
    meshio_mesh m;
    CHECK(read_text(MESHIO_FORMAT_MEDIT, START "Quadrilaterals 2\n1 2 3 4 1 4 3 2 1 2\nEnd\n", &m,
                    NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 4 && m.triangle_tags[0] == 1 && m.triangle_tags[3] == 2);
    meshio_free(&m);
    CHECK(read_text(MESHIO_FORMAT_MEDIT,
                    START "Edges\n2\n1 2 5 3 # c\n 4 6\nTriangles\n2\n1 2 3 7 1 2 4\n8\n"
                          "Tetrahedra\n3\n1 2 3 4 9 1 2 3 4 10 1\n2 3 4 11",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_edges == 2 && m.num_triangles == 2 && m.num_tets == 3 && m.num_spare == 0);
    if (m.num_edges == 2 && m.num_triangles == 2 && m.num_tets == 3)
        CHECK(m.edge_tags[1] == 6 && m.triangle_tags[1] == 8 && m.tet_tags[2] == 11);
    meshio_free(&m);
    CHECK(read_text(MESHIO_FORMAT_MEDIT,
                    START "Quadrilaterals 2\n1 2 3 4 1 1 1 1 1 5\n1 2 3 4 1 1 1 1 1 6\nEnd\n", &m,
                    NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 4 && m.triangle_tags[0] == 5 && m.triangle_tags[3] == 6);
    meshio_free(&m);
#undef START
}

static void msh_ids_may_be_sparse(void)
{
    meshio_mesh m;
    check_tetrahedron(
        MESHIO_FORMAT_MSH,
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 1 \"a\"\n$EndPhysicalNames\n"
        "$Nodes\n4\n"
        "40 0 0 0\n10 1 0 0\n30 0 1 0\n1000000000000 0 0 1\n$EndNodes\n$Elements\n5\n"
        "1 2 2 7 1 40 30 10\n"
        "2 2 2 7 1 40 10 1000000000000\n3 2 0 10 30 1000000000000\n9 15 2 0 1 40\n"
        "4 2 2 0 8 40 1000000000000 30\n$EndElements\n");
    CHECK(
        read_text(
            MESHIO_FORMAT_MSH,
            "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 1 0\n5 0 0 0 1 1 1 1 77 0\n"
            "$EndEntities\n$Nodes\n2 3 1 9\n"
            "0 1 0 1\n9\n0 0 0\n2 5 1 2\n2\n1\n1 0 0 .5 .5\n0 1 0 .5 .5\n$EndNodes\n$Elements\n"
            "2 2 1 2\n2 5 2 1\n1 9 2 1\n"
            "2 6 2 1\n2 9 1 2\n$EndElements\n$Junk\nx y z\n$EndJunk\n",
            &m, NULL) == MESHIO_OK);
    CHECK(m.num_vertices == 3 && m.num_triangles == 2);
    if (m.num_triangles == 2) {
        CHECK(m.triangle_tags[0] == 77 && m.triangle_tags[1] == 6 && m.triangles[1] == 1 &&
              m.triangles[4] == 2);
    }
    meshio_free(&m);
}

/* A group with a minus sign has the entity turned around, in version 4. */
static void msh_groups_have_signs(void)
{
    meshio_mesh m;
    CHECK(read_text(MESHIO_FORMAT_MSH,
                    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 1 2 0\n"
                    "4 0 0 0 1 1 1 1 -9 0\n"
                    "5 0 0 0 1 1 1 1 -8 0\n-6 0 0 0 1 1 1 1 -6 0\n$EndEntities\n$Nodes\n1 4 1 4\n"
                    "2 5 0 4\n1\n2\n3\n4\n"
                    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n$EndNodes\n$Elements\n4 4 1 4\n1 4 1 1\n1 2 3\n"
                    "2 5 2 1\n2 1 2 3\n"
                    "2 5 3 1\n3 1 2 3 4\n2 -6 2 1\n4 1 2 3\n$EndElements\n",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_edges == 1 && m.num_triangles == 4);
    if (m.num_edges == 1 && m.num_triangles == 4) {
        CHECK(m.edge_tags[0] == 9 && m.edges[0] == 2 && m.edges[1] == 1);
        CHECK(m.triangle_tags[0] == 8 && m.triangles[1] == 2 && m.triangles[2] == 1);
        CHECK(m.triangle_tags[1] == 8 && m.triangles[3] == 0 && m.triangles[4] == 3);
        CHECK(m.triangle_tags[3] == -6 && m.triangles[10] == 1); /* as it is written here */
    }
    meshio_free(&m);
}

/* Two triangles and a tetrahedron, tags 7, 8 and 9, in the versions that come after another. */
static void msh_has_several_versions(void)
{
    static const char *const files[] = {
        "$NOD\n5\n1 0 0 0\n2 1 0 0 0 7\n4 0 1 0 2 7 .5 .5\n3 0 0 1\n9 0 0 -1\n$ENDNOD\n$ELM\n4\n"
        "1 2 7 1 3 1 2 4\n"
        "2 2 8 1 3 1 3 4\n3 4 0 9 4 1 2 4 3\n4 15 1 1 1 9\n$ENDELM\n",
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$ParametricNodes\n5\n1 0 0 0 0 1\n2 1 0 0 1 1 .5\n"
        "4 0 1 0 2 1 .5 .5\n"
        "3 0 0 1 3 1\n9 0 0 -1 3 1\n$EndParametricNodes\n$Elements\n3\n1 2 2 7 1 1 2 4\n"
        "2 2 2 8 1 1 3 4\n3 4 2 9 1 1 2 4 3\n"
        "$EndElements\n",
        "$MeshFormat\n4 0 8\n$EndMeshFormat\n$Entities\n1 0 1 1\n5 0 0 0 1 1 1 0\n"
        "5 0 0 0 1 1 1 1 7 0\n"
        "6 0 0 0 1 1 1 1 9 1 5\n$EndEntities\n$Nodes\n2 5\n5 2 1 2\n1 0 0 0 .5 .5\n2 1 0 0 .5 .5\n"
        "6 3 0 3\n4 0 1 0\n3 0 0 1\n"
        "9 0 0 -1\n$EndNodes\n$Elements\n3 3\n5 2 2 1\n1 1 2 4\n8 2 2 1\n2 1 3 4\n6 3 4 1\n"
        "3 1 2 4 3\n$EndElements\n",
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 0\n$EndEntities\n"
        "$PartitionedEntities\n2\n1\n9 2\n1 0 1 1\n"
        "3 0 1 1 1 0 0 0 0\n5 2 5 2 1 2 0 0 0 1 1 1 1 7 0\n6 3 6 1 1 0 0 0 1 1 1 2 9 4 1 5\n"
        "$EndPartitionedEntities\n"
        "$Nodes\n1 5 1 9\n3 6 0 5\n1\n2\n4\n3\n9\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 -1\n$EndNodes\n"
        "$Elements\n3 3 1 3\n2 5 2 1\n"
        "1 1 2 4\n2 8 2 1\n2 1 3 4\n3 6 4 1\n3 1 2 4 3\n$EndElements\n"};
    static const uint32_t corners[] = {0, 1, 2, 0, 3, 2, 0, 1, 2, 3};
    size_t i;
    for (i = 0; i < sizeof files / sizeof files[0]; i++) {
        meshio_mesh m;
        meshio_report report;
        CHECK(read_text(MESHIO_FORMAT_MSH, files[i], &m, &report) == MESHIO_OK);
        if (report.message[0]) printf("%d: %s\n", (int)i, report.message);
        CHECK(m.num_vertices == 5 && m.num_triangles == 2 && m.num_tets == 1);
        if (m.num_triangles == 2 && m.num_tets == 1)
            CHECK(m.triangle_tags[0] == 7 && m.triangle_tags[1] == 8 && m.tet_tags[0] == 9 &&
                  memcmp(m.triangles, corners, 24) == 0 && memcmp(m.tets, corners + 6, 16) == 0 &&
                  m.xyz[14] == -1);
        meshio_free(&m);
    }
}

/* An element in two physical groups is there twice in version 2, maybe turned; others stay. */
static void msh_elements_are_not_repeated(void)
{
    meshio_mesh m;
    CHECK(read_text(MESHIO_FORMAT_MSH,
                    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n"
                    "4 0 0 1\n$EndNodes\n"
                    "$Elements\n7\n1 2 2 5 1 1 2 3\n2 2 2 6 1 1 2 3\n3 2 2 7 1 3 2 1\n"
                    "4 2 2 5 1 1 2 4\n"
                    "5 2 2 5 1 1 2 4\n6 2 2 6 2 1 2 4\n7 4 2 6 2 1 2 3 4\n$EndElements\n",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 4 && m.num_tets == 1);
    if (m.num_triangles == 4)
        CHECK(m.triangle_tags[0] == 5 && m.triangle_tags[1] == 5 && m.triangle_tags[2] == 5 &&
              m.triangle_tags[3] == 6);
    CHECK(m.num_regrouped == 2);
    meshio_free(&m);
}

/* Nodes in the middle of elements and points of no group are nobody's corners; one of a group is
 * wanted. Solids are counted. An entity may be in several groups. */
static void msh_tells_what_is_left_out(void)
{
    static const char *const files[] = {
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n9\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n"
        "5 0 0 2\n6 0 0 3\n"
        "7 .5 0 0\n8 .5 .5 0\n9 0 .5 0\n$EndNodes\n$Elements\n7\n1 15 2 0 1 5\n2 15 2 4 2 6\n"
        "3 15 2 0 3 1\n"
        "4 9 2 8 1 1 2 3 7 8 9\n5 9 2 9 1 1 2 3 7 8 9\n6 8 2 0 1 1 2 7\n7 7 2 0 1 1 2 3 4 6\n"
        "$EndElements\n",
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n3 1 1 1\n1 0 0 2 0\n2 0 0 3 1 4\n"
        "3 0 0 0 0\n"
        "1 0 0 0 1 0 0 0 0\n1 0 0 0 1 1 0 2 8 9 0\n1 0 0 0 1 1 1 0 0\n$EndEntities\n"
        "$Nodes\n1 9 1 9\n3 1 0 9\n1\n2\n3\n4\n5\n6\n7\n8\n9\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 2\n"
        "0 0 3\n"
        ".5 0 0\n.5 .5 0\n0 .5 0\n$EndNodes\n$Elements\n6 6 1 6\n0 1 15 1\n1 5\n0 2 15 1\n2 6\n"
        "0 3 15 1\n3 1\n"
        "2 1 9 1\n4 1 2 3 7 8 9\n1 1 8 1\n5 1 2 7\n3 1 7 1\n6 1 2 3 4 6\n$EndElements\n"};
    meshio_mesh m;
    meshio_report report;
    size_t i;
    for (i = 0; i < 2; i++) {
        CHECK(read_text(MESHIO_FORMAT_MSH, files[i], &m, &report) == MESHIO_OK);
        if (report.message[0]) printf("%s\n", report.message);
        CHECK(m.num_vertices == 9 && m.num_triangles == 1 && m.num_edges == 1);
        CHECK(m.num_solids == 1 && m.num_other == 1 && m.num_regrouped == 1 && m.num_spare == 4);
        CHECK(m.num_triangles == 1 && m.triangle_tags[0] == 8);
        CHECK(m.spare && memcmp(m.spare, "\0\0\0\0\1\0\1\1\1", 9) == 0);
        meshio_free(&m);
    }
    CHECK(read_text(MESHIO_FORMAT_MSH,
                    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n$EndNodes\n"
                    "$Elements\n1\n1 71 2 0 1 1\n$EndElements\n",
                    &m, &report) == MESHIO_ERROR_UNSUPPORTED);
    CHECK(strstr(report.message, "high order") != NULL);
}

/* MSH 4.1 as a 32-bit machine writes it: sizes and numbers of four bytes. */
static void msh_sizes_may_have_32_bits(void)
{
    static const uint32_t nodes[] = {1, 4, 1, 4, 2, 1, 0, 4, 1, 2, 3, 4};
    static const double xyz[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const uint32_t elements[] = {1, 4, 1, 4, 2, 9, 2, 4, 1, 1, 3, 2,
                                        2, 1, 2, 4, 3, 2, 3, 4, 4, 1, 4, 3};
    static const uint32_t one = 1;
    const struct {
        const char *text;
        const void *data;
        size_t size;
    } parts[] = {{"$Comments\n$by hand\n$EndComments\n$MeshFormat\n4.1 1 4\n", &one, sizeof one},
                 {"\n$EndMeshFormat\n$Nodes\n", nodes, sizeof nodes},
                 {"", xyz, sizeof xyz},
                 {"\n$EndNodes\n$Elements\n", elements, sizeof elements},
                 {"\n$EndElements\n", "", 0}};
    unsigned char bytes[512];
    meshio_mesh m;
    size_t n = 0, k;
    for (k = 0; k < sizeof parts / sizeof *parts; k++) {
        memcpy(bytes + n, parts[k].text, strlen(parts[k].text));
        n += strlen(parts[k].text);
        memcpy(bytes + n, parts[k].data, parts[k].size);
        n += parts[k].size;
    }
    CHECK(meshio_read_memory(bytes, n, MESHIO_FORMAT_MSH, &m, NULL) == MESHIO_OK);
    CHECK(m.num_vertices == 4 && m.num_triangles == 4);
    if (m.num_vertices == 4 && m.num_triangles == 4)
        CHECK(m.xyz[11] == 1 && m.triangles[10] == 3 && m.triangle_tags[3] == 9);
    meshio_free(&m);
    for (k = 0; k < n - 14; k++) /* torn: right only between the sections */
        if (meshio_read_memory(bytes, k, MESHIO_FORMAT_MSH, &m, NULL) == MESHIO_OK) {
            CHECK(m.num_vertices == 4 && m.num_triangles == 0);
            meshio_free(&m);
        }
}

static void vtk_cells_and_strips(void)
{
    meshio_mesh m;
    check_tetrahedron(
        MESHIO_FORMAT_VTK,
        "# vtk DataFile Version 2.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n"
        "0 0 0 1 0 0 0 1 0 0 0 1\nPOLYGONS 4 16\n"
        "3 0 2 1 3 0 1 3 3 1 2 3 3 0 3 2\nPOINT_DATA 4\nSCALARS a float\nLOOKUP_TABLE default\n"
        "1 2 3 4\n");
    check_tetrahedron(
        MESHIO_FORMAT_VTK,
        "# vtk DataFile Version 5.1\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n"
        "0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 5 12\n"
        "OFFSETS vtktypeint64\n0 3 6 9 12\nCONNECTIVITY vtktypeint64\n0 2 1 0 1 3 1 2 3 0 3 2\n"
        "CELL_TYPES 4\n5 5 5 5\n");
    CHECK(
        read_text(
            MESHIO_FORMAT_VTK,
            "# vtk DataFile Version 2.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n"
            "0 0 0 1 0 0 0 1 0 1 1 0\nTRIANGLE_STRIPS 1 5\n"
            "4 0 1 2 3\nCELL_DATA 1\nSCALARS region int 1\nLOOKUP_TABLE default\n42\n",
            &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 2 && m.triangles[3] == 1 && m.triangles[4] == 3 &&
          m.triangles[5] == 2 && m.triangle_tags[1] == 42);
    meshio_free(&m);
    CHECK(read_text(MESHIO_FORMAT_VTK, /* as TetGen writes it */
                    "# vtk DataFile Version 2.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n"
                    "POINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n"
                    "0 0 1\n\nCELLS 1 5\n4 0 2 3 1\n\nCELL_TYPES 1\n10\n\nCELL_DATA 1\n"
                    "SCALARS cell_scalars int 1\n"
                    "LOOKUP_TABLE default\n7\n",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_tets == 1 && m.tet_tags && m.tet_tags[0] == 7);
    meshio_free(&m);
}

/* What stands before, between and after the sections that matter: METADATA up to an empty line,
 * fields with strings, all kinds of attributes. The tags are found behind them. */
static void vtk_has_fields_and_metadata(void)
{
    meshio_mesh m;
    meshio_report report;
    CHECK(
        read_text(
            MESHIO_FORMAT_VTK,
            "# vtk DataFile Version 5.1\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nFIELD FieldData 4\n"
            "Name 1 1 string\na%20mesh\n\n"
            "NULL_ARRAY\nTIME 1 1 double\n4.8\nMETADATA\nCOMPONENT_NAMES\nPOINTS\n\nEMPTY 0 0 int\n"
            "METADATA\nINFORMATION 0\n\n"
            "POINTS 4 double\n0 0 0 1 0 0 0 1 0 0 0 1\nMETADATA\nINFORMATION 1\n"
            "NAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1\n\n"
            "CELLS 3 7\nOFFSETS vtktypeint64\n0 4 7\nCONNECTIVITY vtktypeint64\n0 1 2 3 0 2 1\n"
            "CELL_TYPES 2\n10\n5\n"
            "POINT_DATA 4\nSCALARS region int 1\nLOOKUP_TABLE default\n5 5 5 5\nMETADATA\n \t\n\n"
            "LOOKUP_TABLE mine 2\n0 0 0 1 1 1 1 1\n"
            "FIELD FieldData 1\ntag 1 4 double\nnan 1e3 -inf 18446744073709551615\n"
            "CELL_DATA 2\nGLOBAL_IDS ids vtkIdType\n0 1\nVECTORS v float\n0 0 1 0 0 1\n"
            "METADATA\nCOMPONENT_NAMES\nCELLS\n\n\nINFORMATION 1\n" /* two without a name */
            "NAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1\n\n"
            "NORMALS n float\n0 0 1 0 0 1\n"
            "TENSORS t float\n0 0 1 0 0 1 0 0 1 0 0 1 0 0 1 0 0 1\nTEXTURE_COORDINATES x 2 float\n"
            "0 1 0 1\nCOLOR_SCALARS c 3\n0 1 0 1 0 1\n"
            "SCALARS other bit\nLOOKUP_TABLE default\n0 1\nFIELD FieldData 5\nnames 1 2 string\n"
            "FIELD\n\nregion 3 2 int\n1 2 3 4 5 6\n"
            "u 2 2 vtktypeuint64\n1 2 3 4\nMETADATA\nCOMPONENT_NAMES\n\nINFORMATION\n"
            "INFORMATION 0\n\nregion 1 2 int\n42\n-7\n"
            "tag 1 2 int\n1\n1\n",
            &m, &report) == MESHIO_OK);
    if (report.message[0]) printf("%s\n", report.message);
    CHECK(m.num_vertices == 4 && m.num_tets == 1 && m.num_triangles == 1);
    if (m.num_tets == 1 && m.num_triangles == 1)
        CHECK(m.tet_tags[0] == 42 && m.triangle_tags[0] == -7 && m.tets[3] == 3);
    meshio_free(&m);
}

static size_t put_big32(unsigned char *p, size_t n, uint32_t v)
{
    p[n] = (unsigned char)(v >> 24), p[n + 1] = (unsigned char)(v >> 16);
    p[n + 2] = (unsigned char)(v >> 8), p[n + 3] = (unsigned char)v;
    return n + 4;
}

/* The same in binary: strings have headers of one, two, four and eight bytes, bits are packed. */
static void vtk_binary_fields_are_stepped_over(void)
{
    static const uint32_t corners[] = {3, 0, 2, 1, 3, 0, 1, 3};
    unsigned char b[2048];
    size_t n = 0, i, cut;
    meshio_mesh m;
    meshio_report report;
    n = put_text(b, n, "# vtk DataFile Version 4.2\nt\nBINARY\nDATASET POLYDATA\nFIELD f 1\n"
                       "s 2 2 string\n");
    b[n++] = 0xC3, n = put_text(b, n, "a\nb");
    b[n++] = 0x80, b[n++] = 100;
    for (i = 0; i < 100; i++) b[n++] = (unsigned char)i;
    n = put_big32(b, n, 0x40000005), n = put_text(b, n, "POINT");
    n = put_big32(b, n, 0), n = put_big32(b, n, 2), n = put_text(b, n, "\n\n\nPOINTS 4 float\n");
    for (i = 0; i < 12; i++) n = put_big32(b, n, i == 3 || i == 7 || i == 11 ? 0x3F800000 : 0);
    n = put_text(b, n, "\nMETADATA\nINFORMATION 0\n\nPOLYGONS 2 8\n");
    for (i = 0; i < 8; i++) n = put_big32(b, n, corners[i]);
    n = put_text(b, n, "\nCELL_DATA 2\nCOLOR_SCALARS c 1\n\377\n\nSCALARS s bit\n"
                       "LOOKUP_TABLE default\n\300\n"
                       "LOOKUP_TABLE x 1\n\n\n\n\n\n"
                       "FIELD f 2\nbits 5 2 bit\n\n \nregion 1 2 int\n");
    n = put_big32(b, n, 3), n = put_big32(b, n, (uint32_t)-4), n = put_text(b, n, "\n");
    CHECK(meshio_read_memory(b, n, MESHIO_FORMAT_VTK, &m, &report) == MESHIO_OK);
    if (report.message[0]) printf("%s\n", report.message);
    CHECK(m.num_vertices == 4 && m.num_triangles == 2);
    if (m.num_triangles == 2)
        CHECK(m.triangle_tags[0] == 3 && m.triangle_tags[1] == -4 && m.triangles[5] == 3 &&
              m.xyz[11] == 1);
    meshio_free(&m);
    for (i = 0, cut = 0; cut < n; cut++) { /* right only between two sections */
        i += meshio_read_memory(b, cut, MESHIO_FORMAT_VTK, &m, NULL) == MESHIO_OK;
        CHECK(m.num_triangles == 0 || m.num_triangles == 2);
        meshio_free(&m);
    }
    CHECK(i < 40);
}

/* Cells of any order have their corners first. */
static void vtk_curved_cells_are_their_corners(void)
{
    static const struct {
        int type, points, edges, triangles, tets;
    } cells[] = {{21, 3, 1, 0, 0}, {35, 4, 1, 0, 0},  {68, 5, 1, 0, 0},  {22, 6, 0, 1, 0},
                 {34, 7, 0, 1, 0}, {69, 10, 0, 1, 0}, {76, 6, 0, 1, 0},  {23, 8, 0, 2, 0},
                 {28, 9, 0, 2, 0}, {70, 16, 0, 2, 0}, {24, 10, 0, 0, 1}, {71, 20, 0, 0, 1},
                 {78, 10, 0, 0, 1}};
    size_t i;
    int k;
    for (i = 0; i < sizeof cells / sizeof cells[0]; i++) {
        char text[512];
        size_t n;
        meshio_mesh m;
        strcpy(text, "# vtk DataFile Version 2.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n"
                     "POINTS 4 float\n"
                     "0 0 0 1 0 0 1 1 0 0 1 0\n");
        n = strlen(text);
        n += (size_t)snprintf(text + n, sizeof text - n, "CELLS 1 %d\n%d 0 1 2 3",
                              cells[i].points + 1, cells[i].points);
        for (k = 4; k < cells[i].points; k++)
            n += (size_t)snprintf(text + n, sizeof text - n, " 0");
        if (cells[i].points == 3) n -= 2;
        snprintf(text + n, sizeof text - n, "\nCELL_TYPES 1\n%d\n", cells[i].type);
        CHECK(read_text(MESHIO_FORMAT_VTK, text, &m, NULL) == MESHIO_OK);
        CHECK((int)m.num_edges == cells[i].edges && (int)m.num_triangles == cells[i].triangles &&
              (int)m.num_tets == cells[i].tets && m.num_other == 0);
        if (m.num_tets) CHECK(m.tets[3] == 3);
        if (m.num_triangles == 2) CHECK(m.triangles[5] == 3);
        /* nodes beyond the corners are point 3, or 0, a corner */
        CHECK(m.num_spare == (size_t)(cells[i].points > 3 && !m.num_tets && m.num_triangles != 2) +
                                 (size_t)(cells[i].type == 21 || cells[i].type == 35 ||
                                          cells[i].type == 68));
        meshio_free(&m);
    }
}

/* A grid of 6 x 5 points, 40 triangles, in the last five of every row of numbers two regions; as
 * VTK and others write it. */
static const char vtu_head[] =
    "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
    "header_type=\"UInt32\"";
static const char vtu_points[] =
    "<Piece NumberOfPoints=\"30\" NumberOfCells=\"40\"><PointData><DataArray type=\"Int32\" "
    "Name=\"region\" format=\"ascii\"/>"
    "</PointData><Points>\n"
    "<DataArray type=\"Float32\" Name=\"Points\" NumberOfComponents=\"3\" format=";
static const char vtu_corners[] =
    "</DataArray></Points>\n<Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=";
static const char vtu_offsets[] = "</DataArray>\n"
                                  "<DataArray type=\"Int32\" Name=\"offsets\" format=";
static const char vtu_types[] = "</DataArray>\n<DataArray type=\"UInt8\" Name=\"types\" format=";
static const char vtu_tags[] = "</DataArray></Cells>\n<CellData>"
                               "<DataArray type=\"Float32\" Name=\"tag\" NumberOfComponents=\"3\" "
                               "format=\"what\"/>"
                               "<DataArray type=\"Int8\" Name=\"region\" format=";
static const char vtu_end[] = "</DataArray></CellData></Piece></UnstructuredGrid>";

/* Five arrays that zlib has compressed, in base64: codes of their own, two blocks of these, fixed
 * codes, no codes, codes of few symbols. */
static const char *const vtu_zlib[5] = {
        "AQAAAACAAABoAQAAUgAAAA==eNpNzrERACEMxEB3hkq7UiiVgX+wHCnxzlW9G1UZ3UU36qinet/5/53b27mNOuqp"
        "Pof2oD1oD9qD9tAOcpCDHOQgBzmREzmREzmR8/UCCvAkeA==",
        "AgAAAAABAADgAAAAWQAAAFIAAAA=eNotjQkKwDAIBO2Vqklz0P//tUonsDjswEZEZIvc8r+8hW6PKKy47I6IwYbL"
        "7ow47LjsrkiFK66w98B5G13udbjjlL0BD5yxN+GJc/5a8MI19l74A91sAjd42i2NyQ3AMAzDvECvJHbaHPuvWRng"
        "QzAhAnI1s6Icyqk0OG+luxSHHZfdrQQcuOwepcMdV9j74LwvXe4NeOAaexOeOGdvwQsX/Nrwxv3fUwSX",
        "AQAAAACAAACgAAAAbQAAAA==eAFjZmBgYANiTiDmAWJ+IBYCYlEglgBiaSCWA2JFIFYBYnUg1gJiXSA2AGJjIDYD"
        "YksgtgFieyB2AmJXIPYAYm8g9gPiQCAOAeJwII4C4lggTgDiZCBOA+JMIM4B4nwgLgLiUiCuAGIAGt4JnQ==",
        "AQAAAACAAAAoAAAAMwAAAA==eAEBKADX/wUFBQUFBQUFBQUFBQUFBQUFBQUFBQUFBQUFBQUFBQUFBQUFBQUFBQUQ"
        "LADJ",
        "AQAAAACAAAAoAAAADgAAAA==eNpjZMQETFgAAAQuAD0="};

static void check_grid(const char *text)
{
    meshio_mesh m;
    meshio_report report;
    CHECK(read_text(MESHIO_FORMAT_VTU, text, &m, &report) == MESHIO_OK);
    if (report.message[0]) printf("%s\n", report.message);
    CHECK(m.num_vertices == 30 && m.num_triangles == 40);
    if (m.num_vertices == 30 && m.num_triangles == 40) {
        CHECK(m.xyz[87] == 5 && m.xyz[88] == 4 && m.xyz[89] == .5 && m.triangles[119] == 28);
        CHECK(m.triangle_tags[19] == 1 && m.triangle_tags[20] == 2 && m.triangle_tags[39] == 2);
        CHECK(triangle_area_z(&m, 7) == .5 && triangle_area_z(&m, 38) == .5);
    }
    meshio_free(&m);
}

/* The grid's file: each array where it is declared, or all behind the end. */
static void write_grid(char *text, size_t size, const char *const *arrays, const char *compressor,
                       int appended)
{
    const char *parts[] = {vtu_points, vtu_corners, vtu_offsets, vtu_types, vtu_tags};
    size_t n = (size_t)snprintf(text, size, "%s%s><UnstructuredGrid>", vtu_head, compressor);
    size_t offset = 0;
    int i;
    for (i = 0; i < 5; i++) {
        if (appended)
            n += (size_t)snprintf(text + n, size - n, "%s'appended' offset='%lu'>", parts[i],
                                  (unsigned long)offset);
        else
            n += (size_t)snprintf(text + n, size - n, "%s\"binary\">\n  %s\n", parts[i], arrays[i]);
        offset += strlen(arrays[i]);
    }
    n += (size_t)snprintf(text + n, size - n, "%s", vtu_end);
    if (appended) {
        n += (size_t)snprintf(text + n, size - n, "<AppendedData encoding=\"base64\">\n _");
        for (i = 0; i < 5; i++) n += (size_t)snprintf(text + n, size - n, "%s", arrays[i]);
        n += (size_t)snprintf(text + n, size - n, "\n</AppendedData>");
    }
    snprintf(text + n, size - n, "</VTKFile>\n");
}

static void base64_of(const unsigned char *p, size_t size, char *out)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    size_t i;
    for (i = 0; i < size; i += 3) {
        uint32_t group = (uint32_t)p[i] << 16;
        if (i + 1 < size) group |= (uint32_t)p[i + 1] << 8;
        if (i + 2 < size) group |= p[i + 2];
        *out++ = digits[group >> 18];
        *out++ = digits[group >> 12 & 63];
        *out++ = i + 1 < size ? digits[group >> 6 & 63] : '=';
        *out++ = i + 2 < size ? digits[group & 63] : '=';
    }
    *out = 0;
}

static void vtu_data_may_be_compressed(void)
{
    static const char zlib[] = " compressor=\"vtkZLibDataCompressor\"";
    static char text[8192];
    size_t i, n;
    meshio_mesh m;
    meshio_report report;
    write_grid(text, sizeof text, vtu_zlib, zlib, 0);
    check_grid(text);
    /* one digit of the compressed data is another: the sum at the end of the data tells, or
     * before */
    for (i = 0, n = strlen(text); i < n; i++) {
        char was = text[i];
        if (text + i < strstr(text, vtu_zlib[0]) + 24 ||
            text + i >= strstr(text, vtu_zlib[0]) + strlen(vtu_zlib[0]) - 4)
            continue;
        text[i] = was == 'A' ? 'B' : 'A';
        CHECK(read_text(MESHIO_FORMAT_VTU, text, &m, &report) != MESHIO_OK);
        text[i] = was;
    }
    write_grid(text, sizeof text, vtu_zlib, zlib, 1);
    check_grid(text);
    write_grid(text, sizeof text, vtu_zlib, " compressor=\"vtkLZ4DataCompressor\"", 0);
    CHECK(read_text(MESHIO_FORMAT_VTU, text, &m, &report) == MESHIO_ERROR_UNSUPPORTED &&
          strstr(report.message, "vtkLZ4DataCompressor"));
    CHECK(live_blocks == 0);
}

/* The values of the grid's arrays, four bytes into each. */
static void grid_bytes(unsigned char bytes[5][512], size_t sizes[5])
{
    size_t i, k, n;
    for (n = 0, i = 0; i < 30; i++)
        for (k = 0; k < 3; k++, n++) {
            float x = k == 0 ? (float)(i % 6) : k == 1 ? (float)(i / 6) : .5f;
            memcpy(bytes[0] + 4 + 4 * n, &x, 4);
        }
    sizes[0] = 360;
    for (i = 0; i < 40; i++) {
        uint32_t a = (uint32_t)(i / 2 / 5 * 6 + i / 2 % 5), c = i % 2 ? a + 7 : a + 1;
        uint32_t d = i % 2 ? a + 6 : a + 7, end = (uint32_t)(3 * i + 3);
        memcpy(bytes[1] + 4 + 12 * i, &a, 4);
        memcpy(bytes[1] + 8 + 12 * i, &c, 4);
        memcpy(bytes[1] + 12 + 12 * i, &d, 4);
        memcpy(bytes[2] + 4 + 4 * i, &end, 4);
        bytes[3][4 + i] = 5;
        bytes[4][4 + i] = i < 20 ? 1 : 2;
    }
    sizes[1] = 480, sizes[2] = 160, sizes[3] = sizes[4] = 40;
}

/* Comments, spaces around '=', and '>' in a value, as XML allows them. */
static void vtu_tags_may_be_of_any_style(void)
{
    static const char text[] =
        "<?xml version=\"1.0\"?>\n<!-- was <Points> in <Piece> 'once' -->\n"
        "<VTKFile Comment = \"a > b\" type\n=\n'UnstructuredGrid'><UnstructuredGrid>"
        "<Piece NumberOfPoints= \"4\" NumberOfCells =\"1\"><Points>"
        "<!-- <DataArray> --><DataArray type = \"Float64\" NumberOfComponents=\"3\" note='->'>"
        "0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells>"
        "<DataArray type=\"Int32\" Name = \"connectivity\" note='>'>0 1 2 3</DataArray>"
        "<DataArray type=\"Int32\" Name=\"offsets\">4</DataArray>"
        "<DataArray type=\"UInt8\" Name=\"types\">10</DataArray></Cells></Piece>"
        "</UnstructuredGrid></VTKFile>";
    static const char *const torn[] = {"<!-- no end", "<VTKFile type=\"UnstructuredGrid>",
                                       "<VTKFile type", "<VTKFile type= ", "<VTKFile type=\"",
                                       "<!--"};
    meshio_mesh m;
    meshio_report report;
    size_t k;
    CHECK(meshio_read_memory(text, strlen(text), MESHIO_FORMAT_VTU, &m, &report) == MESHIO_OK);
    CHECK(m.num_vertices == 4 && m.num_tets == 1 && m.tets[3] == 3 && m.xyz[11] == 1);
    meshio_free(&m);
    for (k = 0; k < sizeof torn / sizeof *torn; k++)
        CHECK(meshio_read_memory(torn[k], strlen(torn[k]), MESHIO_FORMAT_VTU, &m, &report) ==
              MESHIO_ERROR_TRUNCATED);
}

/* Without compression, header and values encoded at once. */
static void vtu_data_may_be_encoded(void)
{
    static char text[8192], plain[5][1024];
    static unsigned char bytes[5][512];
    const char *arrays[5];
    size_t sizes[5], i;
    meshio_mesh m;
    meshio_report report;
    grid_bytes(bytes, sizes);
    for (i = 0; i < 5; i++) {
        put32(bytes[i], (uint32_t)sizes[i]);
        base64_of(bytes[i], sizes[i] + 4, plain[i]);
        arrays[i] = plain[i];
    }
    write_grid(text, sizeof text, arrays, "", 0);
    check_grid(text);
    write_grid(text, sizeof text, arrays, " compressor=\"\"", 1);
    check_grid(text);
    base64_of(bytes[4], 4, plain[4]); /* the header padded on its own */
    base64_of(bytes[4] + 4, 40, plain[4] + 8);
    write_grid(text, sizeof text, arrays, "", 0);
    check_grid(text);
    put32(bytes[4], 41); /* a byte too many, a byte too few, other digits */
    base64_of(bytes[4], 44, plain[4]);
    write_grid(text, sizeof text, arrays, "", 0);
    CHECK(read_text(MESHIO_FORMAT_VTU, text, &m, &report) == MESHIO_ERROR_COUNT);
    put32(bytes[4], 40);
    base64_of(bytes[4], 43, plain[4]);
    write_grid(text, sizeof text, arrays, "", 0);
    CHECK(read_text(MESHIO_FORMAT_VTU, text, &m, &report) == MESHIO_ERROR_SYNTAX &&
          report.line == 14);
    plain[4][9] = '*';
    write_grid(text, sizeof text, arrays, "", 0);
    CHECK(read_text(MESHIO_FORMAT_VTU, text, &m, &report) == MESHIO_ERROR_SYNTAX);
    CHECK(live_blocks == 0);
}

/* Cuts and changes in compressed and encoded data: any status, but no crash. */
static void torn_encoded_data_never_crash(void)
{
    static char text[8192], torn[8192];
    meshio_mesh m;
    int i, j, appended, accepted = 0;
    for (appended = 0; appended < 2; appended++) {
        size_t n, cut;
        write_grid(text, sizeof text, vtu_zlib, " compressor='vtkZLibDataCompressor'", appended);
        n = strlen(text);
        for (cut = 0; cut < n; cut++) {
            meshio_read_memory(text, cut, MESHIO_FORMAT_VTU, &m, NULL);
            meshio_free(&m);
        }
        for (i = 0; i < 20000; i++) {
            memcpy(torn, text, n + 1);
            for (j = (int)(random_u64() % 4); j > 0; j--)
                torn[random_u64() % n] = "AQg/=\"< 9zZ7"[random_u64() % 12];
            accepted += meshio_read_memory(torn, n, MESHIO_FORMAT_VTU, &m, NULL) == MESHIO_OK;
            meshio_free(&m);
        }
    }
    CHECK(accepted > 10000 && accepted < 30000);
    CHECK(live_blocks == 0);
}

static void stl_text_may_hold_several_solids(void)
{
    meshio_mesh m;
    CHECK(
        read_text(
            MESHIO_FORMAT_STL,
            "\357\273\277solid a b\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
            "vertex 0 1 0\nendloop\nendfacet\nendsolid a b\n"
            "SOLID\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX -0 0 0\nVERTEX 1 0 0\nVERTEX 0 0 1\n"
            "ENDLOOP\nENDFACET\nENDSOLID",
            &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 2 && m.num_vertices == 4 && m.triangle_tags[0] == 1 &&
          m.triangle_tags[1] == 2);
    CHECK(strcmp(m.name, "a b") == 0);
    meshio_free(&m);
}

/* Of a facet of no area some programs write words for a normal. */
static void stl_normals_may_be_anything(void)
{
    meshio_mesh m;
    CHECK(read_text(MESHIO_FORMAT_STL,
                    "solid\nfacet normal -1.#IND nan(0x1) ?\nouter loop\nvertex 0 0 0\n"
                    "vertex 1 0 0\n"
                    "vertex 0 1 0\nendloop\nendfacet\nendsolid\n",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 1 && m.num_vertices == 3);
    meshio_free(&m);
    CHECK(read_text(MESHIO_FORMAT_STL,
                    "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
                    "endfacet\nendsolid\n",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 1 && m.num_vertices == 3);
    meshio_free(&m);
}

/* Some programs do not write the last line; but it may not end within a facet. */
static void stl_text_may_end_after_a_facet(void)
{
    static const char text[] = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                               "vertex 0 1 0\nendloop\nendfacet\n";
    char part[sizeof text];
    meshio_mesh m;
    CHECK(read_text(MESHIO_FORMAT_STL, text, &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 1 && m.num_vertices == 3);
    meshio_free(&m);
    memcpy(part, text, sizeof text);
    strcpy(part + sizeof text - 11, "\n");
    CHECK(read_text(MESHIO_FORMAT_STL, part, &m, NULL) == MESHIO_ERROR_TRUNCATED);
    CHECK(read_text(MESHIO_FORMAT_STL, "solid\n", &m, NULL) == MESHIO_ERROR_TRUNCATED);
}

/* What follows the faces that the header counts, and is no face. */
static void off_may_go_on(void)
{
    static const char *const rest[] = {"",       "\n# 3 0 0 0\n", "3 0 0 7\n", "3 0 0 x\n",
                                       "3 0 0\n", "2 0 0\n",       "3.5 0 0 0", "bye\n",
                                       "-3 0 0 0\n"};
    char text[99];
    size_t i;
    meshio_mesh m;
    for (i = 0; i < sizeof rest / sizeof rest[0]; i++) {
        snprintf(text, sizeof text, "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n%s", rest[i]);
        CHECK(read_text(MESHIO_FORMAT_OFF, text, &m, NULL) == MESHIO_OK && m.num_triangles == 1);
        meshio_free(&m);
    }
}

static void stl_binary_is_known_by_its_size(void)
{
    unsigned char bytes[84 + 50 + 50];
    meshio_mesh m;
    float x[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    memset(bytes, 0, sizeof bytes);
    memcpy(bytes, "solid and yet binary", 20);
    bytes[80] = 1;
    if (!meshio__little_endian()) return;
    memcpy(bytes + 84 + 12, x, sizeof x);
    CHECK(meshio_read_memory(bytes, 84 + 50, MESHIO_FORMAT_STL, &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 1 && m.num_vertices == 3 && m.xyz[3] == 1);
    meshio_free(&m);
    CHECK(meshio_read_memory(bytes, 84 + 57, MESHIO_FORMAT_STL, &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 1);
    meshio_free(&m);
    CHECK(meshio_read_memory(bytes, sizeof bytes, MESHIO_FORMAT_STL, &m, NULL) ==
          MESHIO_ERROR_COUNT); /* there is one more */
    bytes[80] = 0; /* never filled in */
    CHECK(meshio_read_memory(bytes, 84 + 50, MESHIO_FORMAT_STL, &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 1);
    meshio_free(&m);
    CHECK(meshio_read_memory(bytes, 84 + 57, MESHIO_FORMAT_STL, &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 0);
    meshio_free(&m);
    bytes[80] = 2;
    CHECK(meshio_read_memory(bytes, 84 + 57, MESHIO_FORMAT_STL, &m, NULL) == MESHIO_ERROR_COUNT);
    bytes[83] = 255;
    CHECK(meshio_read_memory(bytes, sizeof bytes, MESHIO_FORMAT_STL, &m, NULL) ==
          MESHIO_ERROR_COUNT);
    CHECK(m.xyz == NULL && m.num_vertices == 0);
}

/* Names of physical groups, cut off at 127 bytes; lines that are none are passed over. */
static void msh_names_are_read_and_written(void)
{
    static const char head[] = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n4\n"
                               "2 7 \"outer skin\"\n3 -1 \"a\"\nnonsense\n9 1 \"b\"\n1 2 \"",
                      tail[] = "\"\n$EndPhysicalNames\n$Nodes\n1\n1 0 0 0\n$EndNodes\n";
    char text[sizeof head + sizeof tail + 400];
    meshio_mesh m, again;
    meshio_write_options options;
    int k;
    memset(&options, 0, sizeof options);
    memset(text, 'x', sizeof text);
    memcpy(text, head, sizeof head - 1);
    memcpy(text + sizeof head - 1 + 400, tail, sizeof tail);
    CHECK(read_text(MESHIO_FORMAT_MSH, text, &m, NULL) == MESHIO_OK);
    CHECK(m.num_names == 3 && m.num_vertices == 1);
    if (m.num_names == 3) {
        CHECK(m.names[0].dimension == 2 && m.names[0].tag == 7);
        CHECK(strcmp(m.names[0].text, "outer skin") == 0 && m.names[1].tag == -1);
        CHECK(strlen(m.names[2].text) == 127 && m.names[2].dimension == 1);
    }
    for (k = 0; k < 4; k++) {
        const char *name = file_name(k < 2 ? "msh" : "msh4");
        options.binary = k & 1;
        CHECK(meshio_write(name, &m, &options, NULL) == MESHIO_OK);
        CHECK(meshio_read(name, MESHIO_FORMAT_AUTO, &again, NULL) == MESHIO_OK);
        CHECK(again.num_names == m.num_names &&
              memcmp(again.names, m.names, m.num_names * sizeof *m.names) == 0);
        meshio_free(&again);
        remove(name);
    }
    meshio_free(&m);
}

/* ---- facets of .poly files ---- */

static void stl_binary_may_hold_several_solids(void)
{
    unsigned char bytes[3 * 84 + 4 * 50];
    float one = 1;
    meshio_mesh m;
    size_t at[3] = {0, 134, 318}, i;
    memset(bytes, 0, sizeof bytes);
    for (i = 0; i < 3; i++) {
        memcpy(bytes + at[i], "solid", 5);
        put32(bytes + at[i] + 80, i == 1 ? 2 : 1);
    }
    for (i = 0; i < 2; i++) memcpy(bytes + 134 + 84 + 50 * i + 24 + 4 * i, &one, 4);
    CHECK(meshio_read_memory(bytes, 452, MESHIO_FORMAT_STL, &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 4);
    if (m.num_triangles == 4)
        CHECK(m.triangle_tags[0] == 1 && m.triangle_tags[1] == 2 && m.triangle_tags[2] == 2 &&
              m.triangle_tags[3] == 3 && m.num_vertices == 3);
    meshio_free(&m);
}

/* Reads a flat surface and checks the number of triangles, that all turn one way, and the area. */
static void check_flat(meshio_format format, const char *text, size_t triangles, double area)
{
    meshio_mesh m;
    meshio_report report;
    size_t t;
    double sum = 0;
    CHECK(read_text(format, text, &m, &report) == MESHIO_OK);
    if (report.message[0]) printf("%s\n", report.message);
    CHECK(m.num_triangles == triangles);
    for (t = 0; t < m.num_triangles; t++) {
        double a = triangle_area_z(&m, t);
        CHECK(a * area > 0);
        sum += a;
    }
    CHECK(fabs(sum - area) < 1e-12);
    meshio_free(&m);
}

static void check_flat_poly(const char *text, size_t triangles, double area)
{
    check_flat(MESHIO_FORMAT_POLY, text, triangles, area);
}

static void facets_may_be_concave_and_have_holes(void)
{
    check_flat_poly(
        "6 3 0 0\n0 0 0 0\n1 2 0 0\n2 2 1 0\n3 1 1 0\n4 1 2 0\n5 0 2 0\n1 0\n1\n6 0 1 2 3 4 5\n0\n"
        "0\n",
        4, 3);
    check_flat_poly(
        "6 3 0 0\n1 0 0 0\n2 2 0 0\n3 2 1 0\n4 1 1 0\n5 1 2 0\n6 0 2 0\n1 0\n1\n6 6 5 4 3 2 1\n0\n"
        "0\n",
        4, -3);
    check_flat_poly(
        "8 3 0 0\n0 0 0 0\n1 3 0 0\n2 3 3 0\n3 0 3 0\n4 1 1 0\n5 2 1 0\n6 2 2 0\n7 1 2 0\n1 1\n"
        "2 1 7\n4 0 1 2 3\n4 4 5 6 7\n1 1.5 1.5 0\n0\n0\n",
        8, 8);
    check_flat_poly(
        "8 3 0 0\n0 0 0 0\n1 3 0 0\n2 3 3 0\n3 0 3 0\n4 1 1 0\n5 2 1 0\n6 2 2 0\n7 1 2 0\n1 1\n"
        "2 0 7\n4 0 1 2 3\n4 4 5 6 7\n0\n0\n",
        10, 9);
    check_flat_poly(
        "6 3 0 0\n0 0 0 0\n1 4 0 0\n2 4 4 0\n3 0 4 0\n4 1 2 0\n5 3 2 0\n1 1\n3 0 7\n4 0 1 2 3\n"
        "2 4 5\n1 4\n0\n0\n",
        6, 16);
    check_flat_poly(
        "6 3 0 0\n0 0 0 0\n1 4 0 0\n2 4 4 0\n3 2 4 0\n4 1 4 0\n5 0 4 0\n1 1\n1 0 7\n6 0 1 2 3 4 5\n"
        "0\n0\n",
        4, 16);
    check_flat_poly(
        "5 3 0 0\n0 0 0 0\n1 4 0 0\n2 4 4 0\n3 0 4 0\n4 2 0 0\n1 1\n2\n4 0 1 2 3\n1 4\n0\n0\n", 3,
        16);
}

/* A point, a segment, or a loop without area comes before the outer loop; or there is no such. */
static void facets_may_begin_with_a_segment(void)
{
#define SQUARE "6 3 0 0\n1 0 0 0\n2 4 0 0\n3 4 4 0\n4 0 4 0\n5 1.1 2.1 0\n6 2.2 3.2 0\n1 1\n"
    meshio_mesh m;
    meshio_report report;
    check_flat_poly(SQUARE "2 0 7\n2 1 3\n4 1 2 3 4\n0\n0\n", 2, 16);
    check_flat_poly(SQUARE "3 0 7\n1 5\n2 1 5\n4 1 2 3 4\n0\n0\n", 4, 16);
    check_flat_poly(SQUARE "2 0 7\n3 1 3 1\n4 4 3 2 1\n0\n0\n", 2, -16);
    check_flat_poly("9 3 0 0\n1 .1 .1 0\n2 .3 .3 0\n3 .7 .7 0\n4 0 0 0\n5 1 0 0\n6 1 1 0\n7 0 1 0\n"
                    "8 .2 .6 0\n9 .4 .6 0\n1 1\n2 0 7\n3 1 2 3\n4 4 5 6 7\n0\n0\n", 8, 1);
    CHECK(read_text(MESHIO_FORMAT_POLY, SQUARE "2 0 7\n2 1 3\n1 5\n0\n0\n", &m, &report) ==
          MESHIO_OK);
    CHECK(m.num_triangles == 0 && m.num_edges == 1 && m.edge_tags[0] == 7);
    meshio_free(&m);
    CHECK(read_text(MESHIO_FORMAT_POLY, SQUARE "2 0 7\n3 1 3 1\n2 4 2\n0\n0\n", &m, &report) ==
          MESHIO_ERROR_SYNTAX);
    CHECK(report.line == 9);
    CHECK(read_text(MESHIO_FORMAT_POLY, SQUARE "1 0 7\n4 1 3 1 3\n0\n0\n", &m, &report) ==
          MESHIO_OK);
    CHECK(m.num_triangles == 2); /* nothing is lost */
    meshio_free(&m);
#undef SQUARE
}

/* A plate with n * n square holes, some named twice, some by a point on a diagonal, some
 * outside. */
static void facets_may_have_many_holes(void)
{
    enum { N = 30 };
    char *text = (char *)malloc(N * N * 300), *p = text;
    int i, k;
    p += sprintf(p, "%d 3 0 0\n", 4 * N * N + 4);
    for (i = 0; i < N * N; i++)
        for (k = 0; k < 4; k++)
            p += sprintf(p, "%d %d %d 0\n", 4 * i + k, 3 * (i % N) + 1 + (k == 1 || k == 2),
                         3 * (i / N) + 1 + (k >= 2));
    for (k = 0; k < 4; k++)
        p += sprintf(p, "%d %d %d 0\n", 4 * i + k, k == 1 || k == 2 ? 3 * N : 0,
                     k >= 2 ? 3 * N : 0);
    p += sprintf(p, "1 0\n%d %d\n4", N * N + 1, 2 * N * N + 2);
    for (k = 0; k < 4; k++) p += sprintf(p, " %d", 4 * i + k);
    for (i = 0; i < N * N; i++)
        p += sprintf(p, "\n4 %d %d %d %d", 4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3);
    for (i = 0; i < 2 * N * N; i++) {
        int h = (int)(random_u64() % (N * N));
        if (i < N * N) h = i;
        p += sprintf(p, "\n%d %g %g 0", i, 3 * (h % N) + (i % 3 ? 1.25 : 1.5), 3 * (h / N) + 1.5);
    }
    sprintf(p, "\n%d -1 1.5 0\n%d 1 1000 0\n0\n0\n", i, i);
    check_flat_poly(text, 4 * N * N + 2 + 2 * N * N, 8 * N * N);
    free(text);
}

/* A star of n arms, its centre cut out: long recoveries with many crossed sides. */
static void large_facets_are_recovered(void)
{
    enum { N = 400 };
    char *text = (char *)malloc(N * 200), *p = text;
    int i;
    double area = 0, *x = (double *)malloc(4 * N * sizeof(double));
    meshio_mesh m;
    meshio_report report;
    size_t t;
    for (i = 0; i < 2 * N; i++) {
        double r = i < N ? 3 + (i % 2 ? 2.9 * random_double() : -0.5) : 1 + (i % 2 ? 0.9 : 0);
        double angle = 6.283185307179586 * (double)(i % N) / (double)N;
        x[2 * i] = r * cos(angle);
        x[2 * i + 1] = r * sin(angle);
    }
    p += sprintf(p, "%d 3 0 0\n", 2 * N);
    for (i = 0; i < 2 * N; i++) p += sprintf(p, "%d %.17g %.17g 0\n", i, x[2 * i], x[2 * i + 1]);
    p += sprintf(p, "1 0\n2 1\n%d", N);
    for (i = 0; i < N; i++) p += sprintf(p, " %d", i);
    p += sprintf(p, "\n%d", N);
    for (i = 0; i < N; i++) p += sprintf(p, " %d", N + i);
    sprintf(p, "\n1 0 0 0\n0\n0\n");
    for (i = 0; i < N; i++) {
        int j = (i + 1) % N;
        area += (x[2 * i] * x[2 * j + 1] - x[2 * j] * x[2 * i + 1]) / 2;
        area -=
            (x[2 * N + 2 * i] * x[2 * N + 2 * j + 1] - x[2 * N + 2 * j] * x[2 * N + 2 * i + 1]) / 2;
    }
    CHECK(read_text(MESHIO_FORMAT_POLY, text, &m, &report) == MESHIO_OK);
    CHECK(m.num_triangles == 2 * N);
    for (t = 0; t < m.num_triangles; t++) area -= triangle_area_z(&m, t);
    CHECK(fabs(area) < 1e-9);
    meshio_free(&m);
    free(text);
    free(x);
}

/* Polygons of other files: an L, a quadrilateral with a reflex corner, a square with a corner in a
 * side; faces before their vertices. */
static void polygons_may_be_concave(void)
{
    check_flat(MESHIO_FORMAT_OFF,
               "OFF\n6 1 0\n2 0 0\n2 1 0\n1 1 0\n1 2 0\n0 2 0\n0 0 0\n6 0 1 2 3 4 5\n", 4, 3);
    check_flat(MESHIO_FORMAT_OFF, "OFF\n4 1 0\n2 0 0\n0.5 0.5 0\n0 2 0\n0 0 0\n4 0 1 2 3\n", 2, 1);
    check_flat(MESHIO_FORMAT_OFF, "OFF\n4 1 0\n2 0 0\n0.5 0.5 0\n0 2 0\n0 0 0\n4 3 2 1 0\n", 2,
               -1);
    check_flat(MESHIO_FORMAT_OBJ,
               "f 1 2 3 4 5\nv 0 0 0\nv 1 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n", 3, 4);
    check_flat(MESHIO_FORMAT_OBJ,
               "v 0 2 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 0 0\nf 6 2 3 4 5 1\n", 4, 3);
    /* two holes, each at the end of a bridge */
    check_flat(MESHIO_FORMAT_OFF,
               "OFF\n12 1 0\n0 0 0\n8 0 0\n8 4 0\n0 4 0\n1 1 0\n3 1 0\n3 3 0\n1 3 0\n5 1 0\n"
               "7 1 0\n7 3 0\n5 3 0\n16 0 1 9 8 11 10 9 1 2 3 0 4 7 6 5 4\n",
               14, 24);
    check_flat(MESHIO_FORMAT_OFF,
               "OFF\n8 1 0\n0 0 0\n4 0 0\n4 4 0\n0 4 0\n1 1 0\n3 1 0\n3 3 0\n1 3 0\n"
               "10 4 5 6 7 4 0 3 2 1 0\n",
               8, -12);
}

/* Those that a fan covers keep it, however many corners they have; those whose sides cross, too. */
static void other_polygons_are_fans(void)
{
    char text[20000], *p = text;
    meshio_mesh m;
    meshio_report report;
    int i;
    p += sprintf(p, "OFF\n200 1 0\n");
    for (i = 0; i < 200; i++)
        p += sprintf(p, "%.17g %.17g 0\n", cos(6.283185307179586 * i / 200),
                     sin(6.283185307179586 * i / 200));
    p += sprintf(p, "200");
    for (i = 0; i < 200; i++) p += sprintf(p, " %d", i);
    sprintf(p, "\n");
    CHECK(read_text(MESHIO_FORMAT_OFF, text, &m, &report) == MESHIO_OK && m.num_triangles == 198);
    for (i = 0; i < 198; i++)
        CHECK(m.triangles[3 * i] == 0 && m.triangles[3 * i + 1] == (uint32_t)i + 1 &&
              m.triangles[3 * i + 2] == (uint32_t)i + 2);
    meshio_free(&m);
    CHECK(read_text(MESHIO_FORMAT_OFF, "OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n4 0 1 2 3\n", &m,
                    &report) == MESHIO_OK);
    CHECK(m.num_triangles == 2 && m.triangles[3] == 0 && m.triangles[5] == 3);
    meshio_free(&m);
}

static void poly_keeps_seeds_and_markers(void)
{
    meshio_mesh m;
    CHECK(
        read_text(
            MESHIO_FORMAT_POLY,
            "# c\n4 3 1 1\n0 0 0 0 9 5\n1 1 0 0 9 6\n2 0 1 0 9 7\n3 0 0 1 9 8\n4 1 # facets\n"
            "1 0 11\n3 0 2 1\n1 0 12\n3 0 1 3\n1\n3 1 2 3\n1 0 -1\n3 0 3 2\n"
            "1\n1 .1 .1 .1\n2\n1 .2 .2 .2 5 0.25\n2 .3 .3 .3 6\n",
            &m, NULL) == MESHIO_OK);
    CHECK(m.num_vertices == 4 && m.vertex_tags[3] == 8 && m.num_triangles == 4 &&
          m.triangle_tags[0] == 11 && m.triangle_tags[3] == -1);
    CHECK(m.num_holes == 1 && m.holes[2] == .1 && m.num_regions == 2 && m.regions[3] == 5 &&
          m.regions[4] == .25 && m.regions[9] == -1);
    meshio_free(&m);
    CHECK(read_text(MESHIO_FORMAT_SMESH, "3 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n1 1\n3 1 2 3 44\n0\n",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 1 && m.triangle_tags[0] == 44);
    meshio_free(&m);
    CHECK(read_text(MESHIO_FORMAT_NODE, "3 3 0 0 1 0 0 0 2 1 0\n0 3 0\n1 0\n", &m, NULL) ==
          MESHIO_OK);
    CHECK(m.num_vertices == 3 && m.xyz[7] == 1);
    meshio_free(&m);
}

/* A facet of points and segments only stands for these. */
static void poly_facets_may_be_segments(void)
{
    meshio_mesh m;
    CHECK(read_text(MESHIO_FORMAT_POLY,
                    "4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n5 1\n1 0 7\n3 0 1 2\n1 0 8\n"
                    "2 3 0\n3 0 9\n2 1 3\n1 3\n2 3 2\n1 0 9\n1 2\n0 0 6\n0\n",
                    &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 1 && m.num_edges == 3 && m.num_other == 0);
    if (m.num_edges == 3) {
        CHECK(m.edges[0] == 3 && m.edges[1] == 0 && m.edge_tags[0] == 8);
        CHECK(m.edges[2] == 1 && m.edges[3] == 3 && m.edge_tags[1] == 9);
        CHECK(m.edges[4] == 3 && m.edges[5] == 2 && m.edge_tags[2] == 9);
    }
    meshio_free(&m);
    CHECK(read_text(MESHIO_FORMAT_SMESH, "2 3 0 0\n1 0 0 0\n2 1 0 0\n1 1\n2 1 2 44\n0\n", &m,
                    NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 0 && m.num_edges == 1 && m.edge_tags[0] == 44);
    meshio_free(&m);
}

static void put_file(const char *extension, const char *text)
{
    FILE *f = fopen(file_name(extension), "wb");
    if (f) fputs(text, f), fclose(f);
}

/* Lists in TetGen's files are as long as they claim, but something else may follow. */
static void tetgen_lists_have_their_length(void)
{
    static const char nodes[] = "4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n";
    static const struct {
        const char *ele, *face;
        meshio_result result;
    } files[] = {{"1 4 0\n1 1 2 3 4\n", "1 0\n1 1 2 3\n", MESHIO_OK},
                 {"1 4 0\n1 1 2 3 4\n2 1 2 3 4\n", "1 0\n1 1 2 3\n", MESHIO_ERROR_COUNT},
                 {"1 4 0\n1 1 2 3 4\n", "1 1\n1 1 2 3 0\n2 1 2 4 0\n", MESHIO_ERROR_COUNT},
                 {"1 4 0\n1 1 2 3 4\n# 2 1 2 3 4\n", "1 0\n1 1 2 3\n1 2 3 4\n", MESHIO_OK},
                 {"1 4 0\n1 1 2 3 4\n2 0\n", "0 0\n1 2 3 4\n", MESHIO_OK}};
    size_t i;
    put_file("node", nodes);
    for (i = 0; i < sizeof files / sizeof files[0]; i++) {
        meshio_mesh m;
        meshio_report report;
        put_file("ele", files[i].ele);
        put_file("face", files[i].face);
        CHECK(meshio_read(file_name("ele"), MESHIO_FORMAT_AUTO, &m, &report) == files[i].result);
        CHECK(files[i].result == MESHIO_OK ? m.num_tets == 1 : report.line == 3);
        meshio_free(&m);
    }
    remove(file_name("node"));
    remove(file_name("ele"));
    remove(file_name("face"));
}

static void poly_finds_the_nodes_beside_it(void)
{
    meshio_mesh m;
    meshio_report report;
    put_file("node", "3 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n");
    put_file("poly", "0 3 0 0\n1 0\n1\n3 0 1 2\n0\n0\n");
    CHECK(meshio_read(file_name("poly"), MESHIO_FORMAT_AUTO, &m, &report) == MESHIO_OK);
    CHECK(m.num_vertices == 3 && m.num_triangles == 1);
    meshio_free(&m);
    remove(file_name("node"));
    CHECK(meshio_read(file_name("poly"), MESHIO_FORMAT_AUTO, &m, &report) == MESHIO_ERROR_OPEN);
    remove(file_name("poly"));
}

/* Coordinates that are no numbers, as programs for Windows write them, are read as such. */
static void coordinates_may_be_indefinite(void)
{
    static const struct {
        meshio_format format;
        const char *text; /* N stands for the second coordinate of the second vertex */
    } files[] = {
        {MESHIO_FORMAT_STL, "solid\nfacet normal 0 0 N\nouter loop\nvertex 0 0 0\nvertex 1 N 0\n"
                            "vertex 0 1 0\nendloop\nendfacet\nendsolid\n"},
        {MESHIO_FORMAT_OFF, "OFF\n3 1 0\n0 0 0\n1 N 0\n0 1 0\n3 0 1 2\n"},
        {MESHIO_FORMAT_OFF, "OFF 3 1 0 0 0 0 1 N 0 0 1 0 3 0 1 2"},
        {MESHIO_FORMAT_OFF, "COFF\n3 1 0\n0 0 0 1 1 1\n1 N 0 1 1 1\n0 1 0 1 1 1\n3 0 1 2\n"},
        {MESHIO_FORMAT_OBJ, "v 0 0 0\nv 1 N 0\nv 0 1 0\nf 1 2 3\n"},
        {MESHIO_FORMAT_PLY,
         "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
         "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
         "0 0 0\n1 N 0\n0 1 0\n3 0 1 2\n"},
        {MESHIO_FORMAT_MEDIT,
         "MeshVersionFormatted 2\nDimension 3\nVertices 3\n0 0 0 0\n1 N 0 0\n0 1 0 0\n"
         "Triangles 1\n1 2 3 0\nEnd\n"},
        {MESHIO_FORMAT_MSH,
         "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 N 0\n3 0 1 0\n$EndNodes\n"
         "$Elements\n1\n1 2 0 1 2 3\n$EndElements\n"},
        {MESHIO_FORMAT_VTK, "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\n"
                            "POINTS 3 float\n0 0 0\n1 N 0\n0 1 0\nPOLYGONS 1 4\n3 0 1 2\n"},
        {MESHIO_FORMAT_VTU,
         "<VTKFile type='UnstructuredGrid'><Piece NumberOfPoints='3' NumberOfCells='1'><Points>"
         "<DataArray type='Float64' NumberOfComponents='3' format='ascii'>0 0 0 1 N 0 0 1 0"
         "</DataArray></Points><Cells><DataArray Name='connectivity' type='Int32' format='ascii'>"
         "0 1 2</DataArray><DataArray Name='offsets' type='Int32' format='ascii'>3</DataArray>"
         "<DataArray Name='types' type='UInt8' format='ascii'>5</DataArray></Cells></Piece>"
         "</VTKFile>"},
        {MESHIO_FORMAT_INP, "*NODE\n1, 0, 0, 0\n2, 1, N, 0\n3, 0, 1, 0\n*ELEMENT, TYPE=S3\n"
                            "1, 1, 2, 3\n"},
        {MESHIO_FORMAT_SMESH, "3 3 0 0\n1 0 0 0\n2 1 N 0\n3 0 1 0\n1 0\n3 1 2 3\n0\n"},
        {MESHIO_FORMAT_XYZ, "0 0 0\n1 N 0\n0 1 0\n"}};
    static const char *const words[] = {"-1.#IND", "1.#QNAN0", "1.#INF00", "-nan(ind)", "inf"};
    size_t i, k;
    for (i = 0; i < sizeof files / sizeof files[0]; i++)
        for (k = 0; k < sizeof words / sizeof words[0]; k++) {
            char text[1000];
            const char *s = files[i].text;
            size_t n = 0;
            meshio_mesh m;
            meshio_result result;
            for (; *s; s++) /* an N that is a word */
                if (*s == 'N' && s[-1] == ' ' && (s[1] == ' ' || s[1] == ',' || s[1] == '\n')) {
                    n += (size_t)snprintf(text + n, sizeof text - n, "%s", words[k]);
                } else {
                    text[n++] = *s;
                }
            result = meshio_read_memory(text, n, files[i].format, &m, NULL);
            CHECK(result == MESHIO_OK);
            CHECK(m.num_vertices == 3 && m.xyz[3] == 1 && !(fabs(m.xyz[4]) < 1e300) &&
                  m.xyz[5] == 0 && m.xyz[7] == 1);
            CHECK(files[i].format == MESHIO_FORMAT_XYZ || m.num_triangles == 1);
            meshio_free(&m);
        }
    CHECK(live_blocks == 0);
}

/* ---- damaged files ---- */

static void damaged_texts_get_a_status_and_a_line(void)
{
#define MSH "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
#define VTK "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\n"
    static const struct {
        meshio_format format;
        const char *text;
        meshio_result result;
        uint64_t line;
    } bad[] = {
        {MESHIO_FORMAT_OFF, "", MESHIO_ERROR_TRUNCATED, 1},
        {MESHIO_FORMAT_OFF, "PNG", MESHIO_ERROR_FORMAT, 1},
        {MESHIO_FORMAT_OFF, "nOFF\n3\n1 0 0\n0 0 0\n", MESHIO_ERROR_UNSUPPORTED, 1},
        {MESHIO_FORMAT_OFF, "4nOFF\n3\n1 0 0\n0 0 0\n", MESHIO_ERROR_UNSUPPORTED, 1},
        {MESHIO_FORMAT_MEDIT,
         "MeshVersionFormatted 4\nDimension 3\nVertices 3\n0 0 0 0\n1 0 0 0\n0 1 0 0\n"
         "Triangles 1\n1 2 3 5000000000\n",
         MESHIO_ERROR_TOO_LARGE, 8},
        {MESHIO_FORMAT_MEDIT, "MeshVersionFormatted 4\nDimension 3\nVertices 1\n0 0 0 4294967297\n",
         MESHIO_ERROR_TOO_LARGE, 4},
        {MESHIO_FORMAT_OFF, "OFF BINARY\n", MESHIO_ERROR_UNSUPPORTED, 1},
        {MESHIO_FORMAT_OFF, "4OFF\n1 0 0\n0 0 0 1\n", MESHIO_ERROR_UNSUPPORTED, 1},
        {MESHIO_FORMAT_OFF, "COFF\n2 0 0\n0 0 0 1 1 1\n0 0\n", MESHIO_ERROR_TRUNCATED, 5},
        {MESHIO_FORMAT_OFF, "OFF\n3 1", MESHIO_ERROR_TRUNCATED, 2},
        {MESHIO_FORMAT_OFF, "OFF\n-3 1 0\n", MESHIO_ERROR_COUNT, 3},
        {MESHIO_FORMAT_OFF, "OFF\n4000000000 1 0\n0 0 0\n", MESHIO_ERROR_COUNT, 3},
        {MESHIO_FORMAT_OFF, "OFF\n99999999999999999999 1 0\n0 0 0\n", MESHIO_ERROR_SYNTAX, 2},
        {MESHIO_FORMAT_OFF, "OFF\n1 2147483647 0\n0 0 0\n3 0 0 0\n", MESHIO_ERROR_COUNT, 3},
        {MESHIO_FORMAT_OFF, "OFF\n1 1 0\n0 0 0\n1000000000 0 0 0\n", MESHIO_ERROR_COUNT, 4},
        {MESHIO_FORMAT_OFF, "OFF\n1 1 0\n0 0 0\n-1 0\n", MESHIO_ERROR_COUNT, 4},
        {MESHIO_FORMAT_OFF, "OFF\n1 1 0\n0 0 0\n3 0 0 1\n", MESHIO_ERROR_INDEX, 4},
        {MESHIO_FORMAT_OFF, "OFF\n1 1 0\n0 0 0\n3 0 0 0\n# more\n3 0 0 0", MESHIO_ERROR_COUNT, 6},
        {MESHIO_FORMAT_OFF, "OFF\n1 1 0\n0 0 0\n3 0 0 -1\n", MESHIO_ERROR_INDEX, 4},
        {MESHIO_FORMAT_OFF, "OFF\n1 1 0\n0 0 0\n3 0 0 4294967296\n", MESHIO_ERROR_INDEX, 4},
        {MESHIO_FORMAT_OFF, "OFF\n1 1 0\n0,5 0 0 0\n", MESHIO_ERROR_SYNTAX, 3},
        {MESHIO_FORMAT_OFF, "OFF\n1 1 0\n0x1p3 0 0 0\n", MESHIO_ERROR_SYNTAX, 3},
        {MESHIO_FORMAT_OFF, "OFF\n1 1 0\n0 0 0\n3 0 0 1X\n", MESHIO_ERROR_SYNTAX, 4},
        {MESHIO_FORMAT_OFF, "OFF\n2 0 0\n0.125 0 0\n0 0", MESHIO_ERROR_TRUNCATED, 4},
        {MESHIO_FORMAT_STL, "", MESHIO_ERROR_TRUNCATED, 0},
        {MESHIO_FORMAT_STL, "<html>404</html>", MESHIO_ERROR_FORMAT, 0},
        {MESHIO_FORMAT_STL, "solid a\nfacet normal 0 0 0\nouter loop\nvertx 0 0 0\n",
         MESHIO_ERROR_SYNTAX, 4},
        {MESHIO_FORMAT_STL, "solid a\nfacet normal 0 0 0\n", MESHIO_ERROR_TRUNCATED, 3},
        {MESHIO_FORMAT_STL, "solid a\n", MESHIO_ERROR_TRUNCATED, 2},
        {MESHIO_FORMAT_STL,
         "solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n",
         MESHIO_ERROR_SYNTAX, 6},
        {MESHIO_FORMAT_OBJ, "hello", MESHIO_ERROR_FORMAT, 1},
        {MESHIO_FORMAT_OBJ, "v 0 0\n", MESHIO_ERROR_SYNTAX, 1},
        {MESHIO_FORMAT_OBJ, "v 0 0 XX1\n", MESHIO_ERROR_SYNTAX, 1},
        {MESHIO_FORMAT_OBJ, "v 0 0 0\nf 0 1 1\n", MESHIO_ERROR_INDEX, 2},
        {MESHIO_FORMAT_OBJ, "v 0 0 0\nf 1 1 -2\n", MESHIO_ERROR_INDEX, 2},
        {MESHIO_FORMAT_OBJ, "v 0 0 0\nf 1 1 2\n", MESHIO_ERROR_INDEX, 2},
        {MESHIO_FORMAT_OBJ, "v 0 0 0\nf 1 1 99999999999999999999\n", MESHIO_ERROR_INDEX, 2},
        {MESHIO_FORMAT_OBJ, "v 0 0 0\nf 1 1 x\n", MESHIO_ERROR_SYNTAX, 2},
        {MESHIO_FORMAT_OBJ, "v 0 0 0\nf\n", MESHIO_ERROR_SYNTAX, 2},
        {MESHIO_FORMAT_PLY, "", MESHIO_ERROR_TRUNCATED, 1},
        {MESHIO_FORMAT_PLY, "plx\n", MESHIO_ERROR_SYNTAX, 1},
        {MESHIO_FORMAT_PLY, "ply\nformat binary_middle_endian 1.0\n", MESHIO_ERROR_UNSUPPORTED, 2},
        {MESHIO_FORMAT_PLY, PLY "1\nproperty float q\nend_header\n0\n", MESHIO_ERROR_SYNTAX, 3},
        {MESHIO_FORMAT_PLY, PLY "2147483647" XYZ "end_header\n0 0 0\n", MESHIO_ERROR_COUNT, 8},
        {MESHIO_FORMAT_PLY, PLY "-1" XYZ "end_header\n0 0 0\n", MESHIO_ERROR_COUNT, 8},
        {MESHIO_FORMAT_PLY, PLY "1" XYZ "0 0 0\n", MESHIO_ERROR_SYNTAX, 7},
        {MESHIO_FORMAT_PLY,
         PLY "1" XYZ "element face 1\nproperty list double int vertex_indices\nend_header\n",
         MESHIO_ERROR_SYNTAX, 8},
        {MESHIO_FORMAT_PLY,
         PLY "1" XYZ "element face 1\nproperty list uchar float vertex_indices\nend_header\n",
         MESHIO_ERROR_SYNTAX, 8},
        {MESHIO_FORMAT_PLY,
         PLY
         "1" XYZ
         "element face 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n2000000 0 0\n",
         MESHIO_ERROR_COUNT, 11},
        {MESHIO_FORMAT_PLY,
         PLY "1" XYZ
             "element face 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n3 0 0 7\n",
         MESHIO_ERROR_INDEX, 11},
        {MESHIO_FORMAT_PLY,
         PLY "1" XYZ "element face 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n"
                     "3 0 0 0\n4 0 0 0 0\n",
         MESHIO_ERROR_COUNT, 12},
        {MESHIO_FORMAT_PLY, PLY "1" XYZ "element junk 1000000000000000000\nend_header\n0 0 0\n",
         MESHIO_ERROR_COUNT, 9},
        {MESHIO_FORMAT_PLY, "ply\nformat ascii 1.0\nproperty float x\n", MESHIO_ERROR_SYNTAX, 3},
        {MESHIO_FORMAT_PLY,
         PLY "1" XYZ "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
                     "0 0 0\n4 0 0 -1 1\n",
         MESHIO_ERROR_INDEX, 11},
        {MESHIO_FORMAT_PLY,
         PLY "1" XYZ "element tristrips 1\nproperty list int int strip\nend_header\n0 0 0\n"
                     "3 0 0 0\n",
         MESHIO_ERROR_UNSUPPORTED, 7},
        {MESHIO_FORMAT_MEDIT, "", MESHIO_ERROR_TRUNCATED, 1},
        {MESHIO_FORMAT_MEDIT, "\x01\x02\x03", MESHIO_ERROR_FORMAT, 1},
        {MESHIO_FORMAT_MEDIT, "MeshVersionFormatted 2\nDimension 2\n", MESHIO_ERROR_UNSUPPORTED, 2},
        {MESHIO_FORMAT_MEDIT, "MeshVersionFormatted 2\nVertices 1\n", MESHIO_ERROR_SYNTAX, 2},
        {MESHIO_FORMAT_MEDIT,
         "MeshVersionFormatted 2\nDimension 3\nVertices\n1000000000000\n0 0 0 0\n",
         MESHIO_ERROR_COUNT, 4},
        {MESHIO_FORMAT_MEDIT,
         "MeshVersionFormatted 2\nDimension 3\nVertices 1\n0 0 0 0\nTriangles 1\n0 1 1 0\n",
         MESHIO_ERROR_INDEX, 6},
        {MESHIO_FORMAT_MEDIT,
         "MeshVersionFormatted 2\nDimension 3\nVertices 1\n0 0 0 0\nTetrahedra 1\n1 1 1 2 0\n",
         MESHIO_ERROR_INDEX, 6},
        {MESHIO_FORMAT_MEDIT,
         "MeshVersionFormatted 2\nDimension 3\nVertices 1\n0 0 0 0\nEdgesP2 1\n1 1 2 0\n",
         MESHIO_ERROR_INDEX, 6},
        {MESHIO_FORMAT_MEDIT, "MeshVersionFormatted 2\nDimension 3\nVertices 1\n0 0 0 0\n?\n",
         MESHIO_ERROR_SYNTAX, 5},
        {MESHIO_FORMAT_MSH, "", MESHIO_ERROR_TRUNCATED, 1},
        {MESHIO_FORMAT_MSH, "x", MESHIO_ERROR_FORMAT, 1},
        {MESHIO_FORMAT_MSH, "$MeshFormat\n3 0 8\n$EndMeshFormat\n", MESHIO_ERROR_UNSUPPORTED, 2},
        {MESHIO_FORMAT_MSH, "$NOD\n1\n1 0 0 0\n$ENDNOD\n$ELM\n1\n1 2 0 0 4 1 1 1 1\n$ENDELM\n",
         MESHIO_ERROR_SYNTAX, 7},
        {MESHIO_FORMAT_MSH, "$NOD\n9\n1 0 0 0\n$ENDNOD\n", MESHIO_ERROR_COUNT, 2},
        {MESHIO_FORMAT_MSH, "$NOD\n1\n1 0 0 0\n$ENDNOD\n$ELM\n1\n1 2 0 0 3 1 1 2\n$ENDELM\n",
         MESHIO_ERROR_INDEX, 7},
        {MESHIO_FORMAT_MSH, "$MeshFormat\n4 0 8\n$EndMeshFormat\n$PartitionedEntities\n2 999999\n",
         MESHIO_ERROR_COUNT, 5},
        {MESHIO_FORMAT_MSH, "$MeshFormat\n99.9 0 8\n$EndMeshFormat\n", MESHIO_ERROR_UNSUPPORTED, 2},
        {MESHIO_FORMAT_MSH, "$MeshFormat\n2.2 0 4\n$EndMeshFormat\n", MESHIO_ERROR_UNSUPPORTED, 2},
        {MESHIO_FORMAT_MSH, "$MeshFormat\n2.2 7 8\n$EndMeshFormat\n", MESHIO_ERROR_SYNTAX, 2},
        {MESHIO_FORMAT_MSH, MSH, MESHIO_ERROR_TRUNCATED, 4},
        {MESHIO_FORMAT_MSH, MSH "$Nodes\n1000000000000000000\n1 0 0 0\n", MESHIO_ERROR_COUNT, 5},
        {MESHIO_FORMAT_MSH, MSH "$Nodes\n2\n1 0 0 0\n1 0 0 0\n$EndNodes\n", MESHIO_ERROR_INDEX, 7},
        {MESHIO_FORMAT_MSH, MSH "$Nodes\n1\n1 0 0 0\n$Elements\n", MESHIO_ERROR_SYNTAX, 7},
        {MESHIO_FORMAT_MSH, MSH "$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n1 999 0 1\n",
         MESHIO_ERROR_SYNTAX, 10},
        {MESHIO_FORMAT_MSH,
         MSH "$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n1 2 0 1 1 2\n$EndElements\n",
         MESHIO_ERROR_INDEX, 10},
        {MESHIO_FORMAT_MSH,
         MSH "$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n1 2 99999 1 1 2\n$EndElements\n",
         MESHIO_ERROR_COUNT, 10},
        {MESHIO_FORMAT_MSH, MSH "$Junk\n", MESHIO_ERROR_TRUNCATED, 4},
        {MESHIO_FORMAT_MSH,
         "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 1 1 1\n2 1 0 2\n1\n2\n0 0 0\n0 0 0\n",
         MESHIO_ERROR_COUNT, 6},
        {MESHIO_FORMAT_MSH,
         "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 2 1 1\n2 1 0 1\n1\n0 0 0\n$EndNodes\n",
         MESHIO_ERROR_COUNT, 8},
        {MESHIO_FORMAT_POLY,
         "3 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n1 0\n1\n3 0 1 2\n0\n1\n0 nan 0 0 1\n",
         MESHIO_ERROR_SYNTAX, 10},
        {MESHIO_FORMAT_POLY,
         "3 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n1 0\n1\n3 0 1 2\n1\n0 0 inf 0\n0\n",
         MESHIO_ERROR_SYNTAX, 9},
        {MESHIO_FORMAT_VTK, "", MESHIO_ERROR_TRUNCATED, 1},
        {MESHIO_FORMAT_VTK, "vtk\n", MESHIO_ERROR_FORMAT, 1},
        {MESHIO_FORMAT_VTK, "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_GRID\n",
         MESHIO_ERROR_UNSUPPORTED, 4},
        {MESHIO_FORMAT_VTK, VTK "POINTS 99999999999 float\n0 0 0\n", MESHIO_ERROR_COUNT, 5},
        {MESHIO_FORMAT_VTK, VTK "POINTS 1 float\n0 0 0\nPOLYGONS 1 3\n3 0 0 0\n",
         MESHIO_ERROR_COUNT, 7},
        {MESHIO_FORMAT_VTK, VTK "POINTS 1 float\n0 0 0\nPOLYGONS 1 4\n3 0 0 1\n",
         MESHIO_ERROR_INDEX, 8},
        {MESHIO_FORMAT_VTK, VTK "POINTS 1 float\n0 0 0\nCELLS 1 4\n3 0 0 0\n",
         MESHIO_ERROR_TRUNCATED, 9},
#define CELL "POINTS 1 float\n0 0 0\nPOLYGONS 1 4\n3 0 0 0\n"
        {MESHIO_FORMAT_VTK, VTK CELL "CELL_DATA 2\n", MESHIO_ERROR_COUNT, 9},
        {MESHIO_FORMAT_VTK, VTK CELL "POINT_DATA 2\n", MESHIO_ERROR_COUNT, 9},
        {MESHIO_FORMAT_VTK, VTK CELL "CELL_DATA 1\nSCALARS region int 1\nLOOKUP_TABLE default\nx\n",
         MESHIO_ERROR_SYNTAX, 12},
        {MESHIO_FORMAT_VTK,
         VTK CELL "CELL_DATA 1\nSCALARS region long 1\nLOOKUP_TABLE default\n4294967297\n",
         MESHIO_ERROR_TOO_LARGE, 12},
        {MESHIO_FORMAT_VTK, VTK CELL "CELL_DATA 1\nVECTORS v float\n0 0\n",
         MESHIO_ERROR_TRUNCATED, 12},
        {MESHIO_FORMAT_VTK, VTK CELL "CELL_DATA 1\nVECTORS v quaternion\n0 0\n",
         MESHIO_ERROR_UNSUPPORTED, 10},
        {MESHIO_FORMAT_VTK, VTK CELL "CELL_DATA 1\nWORDS v float\n0 0\n", MESHIO_ERROR_SYNTAX, 10},
        {MESHIO_FORMAT_VTK, VTK CELL "POINT_DATA 1\nCOLOR_SCALARS c -1\n", MESHIO_ERROR_COUNT, 10},
        {MESHIO_FORMAT_VTK, VTK CELL "POINT_DATA 1\nLOOKUP_TABLE c 999999999999999999\n",
         MESHIO_ERROR_COUNT, 10},
        {MESHIO_FORMAT_VTK, VTK CELL "VECTORS v float\n0 0 0\n", MESHIO_ERROR_SYNTAX, 9},
        {MESHIO_FORMAT_VTK, VTK "FIELD f 1\na 4611686018427387904 4 int\n1\n",
         MESHIO_ERROR_COUNT, 6},
        {MESHIO_FORMAT_VTK, VTK "FIELD f 1\na -1 4 int\n1\n", MESHIO_ERROR_COUNT, 6},
        {MESHIO_FORMAT_VTK, VTK "FIELD f 1\na 1 99 int\n1\n", MESHIO_ERROR_COUNT, 6},
        {MESHIO_FORMAT_VTK, VTK "FIELD f 1\na 1 99 string\n1\n", MESHIO_ERROR_COUNT, 7},
        {MESHIO_FORMAT_VTK, VTK "FIELD f 1\na 1 2 string\n1\n", MESHIO_ERROR_TRUNCATED, 8},
        {MESHIO_FORMAT_VTK, VTK "FIELD f 2\na 1 1 int\n1\n", MESHIO_ERROR_TRUNCATED, 8},
        {MESHIO_FORMAT_VTK, VTK CELL "CELL_DATA 1\nSCALARS region int\nLOOKUP_TABLE default\n7\n"
                                     "LINES 1 3\n2 0 0\n",
         MESHIO_ERROR_COUNT, 15},
#undef CELL
#define VTU                                                                                        \
    "<VTKFile type='UnstructuredGrid'>\n<Piece NumberOfPoints='1' NumberOfCells='0'>\n"            \
    "<Points>\n<DataArray type='Float32' "
        {MESHIO_FORMAT_VTU, VTU "format='ascii'>\n0 0 0 0</DataArray>", MESHIO_ERROR_SYNTAX, 5},
        {MESHIO_FORMAT_VTU, VTU "format='hex'>\n0 0 0</DataArray>", MESHIO_ERROR_UNSUPPORTED, 4},
        {MESHIO_FORMAT_VTU, VTU "format='binary'>\nDAAAAAAAAAA</DataArray>",
         MESHIO_ERROR_SYNTAX, 4},
        {MESHIO_FORMAT_VTU, VTU "format='binary'>\nDgAAAA==</DataArray>", MESHIO_ERROR_COUNT, 4},
        {MESHIO_FORMAT_VTU, VTU "format='binary'>\n</DataArray>", MESHIO_ERROR_SYNTAX, 4},
        {MESHIO_FORMAT_VTU, VTU "format='appended' offset='0'>", MESHIO_ERROR_TRUNCATED, 4},
#undef VTU
#define VTU(name)                                                                                  \
    "<VTKFile type='UnstructuredGrid'>\n<Piece NumberOfPoints='1' NumberOfCells='1'>\n"            \
    "<Cells>\n<DataArray Name='" name "' type='UInt8' format='ascii'>\n1</DataArray>\n"            \
    "<DataArray Name='" name "' type='UInt8' format='ascii'>\n1</DataArray>\n"
        {MESHIO_FORMAT_VTU, VTU("types"), MESHIO_ERROR_SYNTAX, 6},
        {MESHIO_FORMAT_VTU, VTU("offsets"), MESHIO_ERROR_SYNTAX, 6},
#undef VTU
        {MESHIO_FORMAT_VTU, "", MESHIO_ERROR_TRUNCATED, 1},
        {MESHIO_FORMAT_VTU, "<html></html>", MESHIO_ERROR_FORMAT, 1},
        {MESHIO_FORMAT_VTU, "<VTKFile type=\"PolyData\">", MESHIO_ERROR_UNSUPPORTED, 1},
        {MESHIO_FORMAT_VTU, "<VTKFile type=\"UnstructuredGrid\" compressor=\"z\">",
         MESHIO_ERROR_UNSUPPORTED, 1},
        {MESHIO_FORMAT_VTU, "<VTKFile type=\"UnstructuredGrid\">\n<Piece NumberOfPoints=\"-1\">",
         MESHIO_ERROR_SYNTAX, 2},
        {MESHIO_FORMAT_VTU,
         "<VTKFile type=\"UnstructuredGrid\">\n"
         "<Piece NumberOfPoints=\"99999999\" NumberOfCells=\"0\">",
         MESHIO_ERROR_COUNT, 2},
        {MESHIO_FORMAT_INP, "", MESHIO_ERROR_FORMAT, 1},
        {MESHIO_FORMAT_INP, "*HEADING\n", MESHIO_ERROR_FORMAT, 1},
        {MESHIO_FORMAT_INP, "*NODE\n1, 0, 0, 0\n** twice\n1, 1, 0, 0\n", MESHIO_ERROR_INDEX, 5},
        {MESHIO_FORMAT_INP, "*NODE\n1, x\n", MESHIO_ERROR_SYNTAX, 2},
        {MESHIO_FORMAT_INP, "*NODE\n1\n*ELEMENT, TYPE=C3D4\n1, 1, 1, 1\n", MESHIO_ERROR_SYNTAX, 4},
        {MESHIO_FORMAT_INP, "*NODE\n1\n*ELEMENT, TYPE=C3D4\n1, 1, 1, 1, 2\n",
         MESHIO_ERROR_INDEX, 4},
        {MESHIO_FORMAT_INP, "*NODE\n1\n*include, input=a\n", MESHIO_ERROR_UNSUPPORTED, 3},
        {MESHIO_FORMAT_NODE, "", MESHIO_ERROR_TRUNCATED, 1},
        {MESHIO_FORMAT_NODE, "2 3 0 0\n1 0 0 0\n3 0 0 0\n", MESHIO_ERROR_INDEX, 3},
        {MESHIO_FORMAT_NODE, "1 2 0 0\n1 0 0\n", MESHIO_ERROR_UNSUPPORTED, 1},
        {MESHIO_FORMAT_NODE, "1000000000 3 0 0\n1 0 0 0\n", MESHIO_ERROR_COUNT, 1},
        {MESHIO_FORMAT_NODE, "1 3 0 0\n1 0 0 0\n# more\n2 0 1 0\n", MESHIO_ERROR_COUNT, 4},
        {MESHIO_FORMAT_POLY, "1 3 0 0\n1 0 0 0\n2 0\n1\n3 1 1 1\n", MESHIO_ERROR_TRUNCATED, 6},
        {MESHIO_FORMAT_POLY, "1 3 0 0\n1 0 0 0\n1 0\n1\n-3 1 1 1\n", MESHIO_ERROR_COUNT, 5},
        {MESHIO_FORMAT_POLY, "1 3 0 0\n1 0 0 0\n1 0\n1\n3 1 1 2\n", MESHIO_ERROR_INDEX, 5},
        {MESHIO_FORMAT_POLY, "0 3 0 0\n", MESHIO_ERROR_COUNT, 1},
        {MESHIO_FORMAT_POLY,
         "3 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n1 0\n1\n3 1 2 3\n0\n0 # none\n# more\n1\n3 1 3 2\n",
         MESHIO_ERROR_COUNT, 11},
        {MESHIO_FORMAT_SMESH,
         "3 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n1 0\n3 1 2 3\n1\n1 0 0 0\n1\n1 1 1 1 5 6 7\n"
         "2 2 2 2 6 7\n",
         MESHIO_ERROR_COUNT, 11},
        {MESHIO_FORMAT_POLY,
         "6 3 0 0\n0 0 0 0\n1 2 0 0\n2 2 2 0\n3 0 2 0\n4 1 -1 0\n5 1 3 0\n1 0\n2\n4 0 1 2 3\n"
         "2 4 5\n0\n",
         MESHIO_ERROR_SYNTAX, 9},
        {MESHIO_FORMAT_ELE, "1 4 0\n1 1 2 3 4\n", MESHIO_ERROR_INDEX, 2},
        {MESHIO_FORMAT_ELE, "1 5 0\n1 1 2 3 4 5\n", MESHIO_ERROR_UNSUPPORTED, 1},
        {MESHIO_FORMAT_AUTO, "x", MESHIO_ERROR_INVALID_ARGUMENT, 0},
    };
    size_t i;
    for (i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        meshio_mesh m;
        meshio_report report;
        meshio_result result = read_text(bad[i].format, bad[i].text, &m, &report);
        int right = result == bad[i].result && report.result == result &&
                    report.line == bad[i].line && report.message[0] != 0 && m.xyz == NULL &&
                    report.offset <= strlen(bad[i].text) &&
                    m.num_vertices == 0 && m.num_triangles == 0;
        if (!right)
            printf("case %d: status %d (expected %d), line %d (%d): %s\n", (int)i, (int)result,
                   (int)bad[i].result, (int)report.line, (int)bad[i].line, report.message);
        CHECK(right);
        meshio_free(&m);
    }
    CHECK(live_blocks == 0);
}

static void lying_binary_files_are_refused(void)
{
    unsigned char b[256];
    meshio_mesh m;
    meshio_report report;
    memset(b, 0, sizeof b);
    put32(b, 1), put32(b + 4, 2), put32(b + 8, 3), put32(b + 12, 20), put32(b + 16, 3);
    put32(b + 20, 4), put32(b + 24, 256), put32(b + 28, 0x7FFFFFFF);
    CHECK(meshio_read_memory(b, 256, MESHIO_FORMAT_MEDIT_BINARY, &m, &report) ==
              MESHIO_ERROR_COUNT &&
          report.offset > 0);
    put32(b + 24, 8); /* the next keyword is said to be before this one */
    CHECK(meshio_read_memory(b, 256, MESHIO_FORMAT_MEDIT_BINARY, &m, &report) ==
          MESHIO_ERROR_COUNT);
    put32(b + 24, 0xFFFFFFFF);
    CHECK(meshio_read_memory(b, 256, MESHIO_FORMAT_MEDIT_BINARY, &m, &report) ==
          MESHIO_ERROR_COUNT);
    put32(b + 24, 256), put32(b + 28, 0xFFFFFFFF);
    CHECK(meshio_read_memory(b, 256, MESHIO_FORMAT_MEDIT_BINARY, &m, &report) ==
          MESHIO_ERROR_COUNT);
    put32(b + 28, 8); /* 8 * 28 bytes fill the file: right */
    CHECK(meshio_read_memory(b, 256, MESHIO_FORMAT_MEDIT_BINARY, &m, &report) == MESHIO_OK &&
          m.num_vertices == 8);
    meshio_free(&m);
    put32(b + 28, 7);
    CHECK(meshio_read_memory(b, 256, MESHIO_FORMAT_MEDIT_BINARY, &m, &report) ==
          MESHIO_ERROR_COUNT);
    put32(b, 7);
    CHECK(meshio_read_memory(b, 256, MESHIO_FORMAT_MEDIT_BINARY, &m, &report) ==
          MESHIO_ERROR_FORMAT);
    CHECK(meshio_read_memory(b, 3, MESHIO_FORMAT_MEDIT_BINARY, &m, &report) ==
          MESHIO_ERROR_TRUNCATED);
    put32(b, 1), put32(b + 4, 9);
    CHECK(meshio_read_memory(b, 256, MESHIO_FORMAT_MEDIT_BINARY, &m, &report) ==
          MESHIO_ERROR_UNSUPPORTED);
    CHECK(live_blocks == 0);
}

/* Cuts and random bytes in files of every format: any status, but no crash, hang or leak. */
static void torn_files_never_crash(void)
{
    static const struct {
        const char *extension;
        int binary;
    } kinds[] = {{"mesh", 0}, {"meshb", 0}, {"msh", 0}, {"msh", 1}, {"msh4", 0},
                 {"msh4", 1}, {"vtu", 0},   {"vtk", 0}, {"vtk", 1}, {"off", 0},
                 {"obj", 0},  {"stl", 0},   {"node", 0}, {"inp", 0}};
    size_t k, size, cut;
    for (k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
        meshio_mesh m = sample(), back;
        meshio_write_options options;
        char *bytes, *torn;
        const char *name = file_name(kinds[k].extension);
        meshio_format format = meshio_format_of(name);
        int i, refused = 0;
        double xyz[18];
        for (i = 0; i < 18; i++) /* within single precision, for STL */
            xyz[i] = fabs(m.xyz[i]) < 1e38 ? m.xyz[i] : 1e38;
        m.xyz = xyz;
        memset(&options, 0, sizeof options);
        options.binary = kinds[k].binary;
        CHECK(meshio_write(name, &m, &options, NULL) == MESHIO_OK);
        bytes = load(name, &size);
        remove(name);
        CHECK(bytes != NULL && size > 0);
        if (!bytes) continue;
        torn = (char *)malloc(size);
        for (cut = 0; cut < size; cut++) {
            refused += meshio_read_memory(bytes, cut, format, &back, NULL) != MESHIO_OK;
            meshio_free(&back);
        }
        /* .inp files have no counts: they may end behind any line, and within those not read */
        CHECK(refused > (format == MESHIO_FORMAT_INP ? 30 : (int)(size / 2)));
        for (i = 0; i < 3000; i++) {
            int j, changes = 1 + (int)(random_u64() % 3);
            memcpy(torn, bytes, size);
            for (j = 0; j < changes; j++) {
                static const char likely[] = "0129-. \n#e$\377";
                char byte = i % 2 ? likely[random_u64() % (sizeof likely - 1)] : (char)random_u64();
                torn[random_u64() % size] = byte;
            }
            meshio_read_memory(torn, size, format, &back, NULL);
            meshio_free(&back);
        }
        free(torn);
        free(bytes);
        CHECK(live_blocks == 0);
    }
}

/* The same with texts that no writer makes: PLY, facets with holes in TetGen files. */
static void torn_texts_never_crash(void)
{
    static const struct {
        meshio_format format;
        const char *text;
    } files[] = {
        {MESHIO_FORMAT_PLY, PLY
         "4" XYZ
         "element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n"
         "0 0 1\n3 0 1 2\n4 0 1 2 3\n"},
        {MESHIO_FORMAT_POLY,
         "8 3 0 0\n0 0 0 0\n1 3 0 0\n2 3 3 0\n3 0 3 0\n4 1 1 0\n5 2 1 0\n6 2 2 0\n7 1 2 0\n1 1\n"
         "2 1 7\n4 0 1 2 3\n4 4 5 6 7\n1 1.5 1.5 0\n1\n1 0 0 0\n1\n1 0 0 0 1 1\n"},
        {MESHIO_FORMAT_POLY,
         "9 3 0 0\n0 0 0 0\n1 3 0 0\n2 3 3 0\n3 0 3 0\n4 1 1 0\n5 2 1 0\n6 2 2 0\n7 1 2 0\n"
         "8 1.5 1.25 0\n1 1\n4 0 7\n4 0 1 2 3\n2 4 5\n2 6 4\n1 8\n0\n0\n"},
        {MESHIO_FORMAT_SMESH,
         "6 3 0 0\n0 0 0 0\n1 2 0 0\n2 2 1 0\n3 1 1 0\n4 1 2 0\n5 0 2 0\n1 1\n6 0 1 2 3 4 5 9\n0\n"
         "0\n"},
        {MESHIO_FORMAT_OFF,
         "COFF\n4 4 0\n\n0 0 0 .9 0 0 #red\n1 0 0 0 0 .9\n0 1 0 9 9 9\n0 0 1 1 1 1\n\n3 0 2 1\n"
         "3 0 1 3\n3 1 2 3\n3 0 3 2\n"},
        {MESHIO_FORMAT_MSH,
         "$NOD\n3\n1 0 0 0\n2 1 0 0\n4 0 1 0\n$ENDNOD\n$ELM\n2\n1 2 7 1 3 1 2 4\n2 2 8 1 3 1 4 2\n"
         "$ENDELM\n"},
        {MESHIO_FORMAT_MSH,
         "$MeshFormat\n4 0 8\n$EndMeshFormat\n$PartitionedEntities\n2 0\n1 0 1 0\n"
         "3 0 1 1 1 0 0 0 0 0 0 0\n5 2 5 2 1 2 0 0 0 1 1 1 1 7 0\n"
         "$EndPartitionedEntities\n$Nodes\n1 3\n5 2 1 3\n1 0 0 0 0 0\n2 1 0 0 0 0\n4 0 1 0 0 0\n"
         "$EndNodes\n$Elements\n1 1\n5 2 2 1\n"
         "1 1 2 4\n$EndElements\n"},
        {MESHIO_FORMAT_VTK,
         "# vtk DataFile Version 5.1\nt\nASCII\nDATASET POLYDATA\nFIELD F 1\ns 1 1 string\nx\n"
         "POINTS 3 float\n0 0 0 1 0 0 0 1 0\n"
         "METADATA\nINFORMATION 0\n\nPOLYGONS 2 3\nOFFSETS int\n0 3\nCONNECTIVITY int\n0 1 2\n"
         "CELL_DATA 1\nVECTORS v float\n0 0 1\n"
         "FIELD F 2\nb 2 1 bit\n0 1\ntag 1 1 int\n7\n"},
        {MESHIO_FORMAT_INP,
         "*Part, name=A\n*Node\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n"
         "*Element, type=C3D4\n1, 1, 2, 3, 4\n*Elset, elset=E, generate\n"
         "1, 1, 1\n*Solid Section, elset=E\n,\n*Surface, name=S\nE, S1\n*End Part\n*Assembly\n"
         "*Instance, name=I, part=A\n1, 2, 3\n"
         "0, 0, 0, 0, 0, 1, 90\n*End Instance\n*Elset, elset=F, instance=I\n1\n*Surface, name=T\n"
         "F, S2\n*End Assembly\n"}};
    size_t k;
    for (k = 0; k < sizeof files / sizeof files[0]; k++) {
        size_t size = strlen(files[k].text);
        char torn[1024];
        meshio_mesh m;
        int i, j, accepted = 0;
        for (i = 0; i < 20000; i++) {
            int changes = (int)(random_u64() % 4);
            memcpy(torn, files[k].text, size);
            for (j = 0; j < changes; j++)
                torn[random_u64() % size] = "0123456789.- \ne"[random_u64() % 15];
            accepted += meshio_read_memory(torn, size, files[k].format, &m, NULL) == MESHIO_OK;
            meshio_free(&m);
        }
        CHECK(accepted > 5000 && accepted < 20000);
        CHECK(live_blocks == 0);
    }
}

/* ---- memory and the file system ---- */

static void every_failing_allocation_is_reported(void)
{
    static const struct {
        meshio_format format;
        const char *text;
    } files[] = {
        {MESHIO_FORMAT_OFF, "OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n4 0 1 2 3\n"},
        {MESHIO_FORMAT_OFF,
         "OFF\n7 1 0\n4 0 0\n4 4 0\n3 4 0\n3 1 0\n1 1 0\n1 4 0\n0 0 0\n7 0 1 2 3 4 5 6\n"},
        {MESHIO_FORMAT_STL,
         "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
         "endloop\nendfacet\nendsolid\n"},
        {MESHIO_FORMAT_OBJ, "v 0 0 0\nf 1 1 1\n"},
        {MESHIO_FORMAT_MSH,
         "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 1 0\n5 0 0 0 1 1 1 1 77 0\n"
         "$EndEntities\n$Nodes\n1 2 1 9\n0 1 0 2\n9\n3\n0 0 0\n1 1 1\n"
         "$EndNodes\n$Elements\n1 1 1 1\n3 5 4 1\n1 9 9 3 3\n$EndElements\n"},
        {MESHIO_FORMAT_MSH,
         "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 1 0 0\n5 0 0 0 1 1 1 2 77 78 0\n"
         "$EndEntities\n$Nodes\n1 3 1 3\n0 1 0 3\n1\n2\n3\n"
         "0 0 0\n1 1 1\n2 2 2\n$EndNodes\n$Elements\n1 1 1 1\n1 5 8 1\n1 1 2 3\n$EndElements\n"},
        {MESHIO_FORMAT_VTK,
         "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 1 float\n0 0 0\n"
         "CELLS 1 3\n2 0 0\nCELL_TYPES 1\n3\nCELL_DATA 1\n"
         "SCALARS region int 1\nLOOKUP_TABLE default\n42\n"},
        {MESHIO_FORMAT_INP,
         "*NODE\n1, 0, 0, 0\n2, 1\n4, 0, 1\n5, 0, 0, 1\n*ELEMENT, TYPE=C3D4, ELSET=A\n"
         "1, 1, 2, 4, 5\n*ELEMENT, TYPE=S4\n2, 1, 2, 4, 5\n*SURFACE, NAME=B\n1, S1\n"},
        {MESHIO_FORMAT_VTU,
         "<VTKFile type='UnstructuredGrid' compressor='vtkZLibDataCompressor'><Piece "
         "NumberOfPoints='1' NumberOfCells='0'><Points>"
         "<DataArray type='Float32' format='binary'>AQAAAAwAAAAAAAAACwAAAA==eJxjYEAAAAAMAAE="
         "</DataArray></Points></Piece></VTKFile>"},
        {MESHIO_FORMAT_INP,
         "*Part, name=A\n*Node\n1, 0, 0, 0\n2, 1\n4, 0, 1\n5, 0, 0, 1\n*Element, type=C3D4\n"
         "1, 1, 2, 4, 5\n*Elset, elset=E\n1\n*Solid Section, elset=E\n"
         "*Surface, name=B\nE, S1\n*End Part\n"},
        {MESHIO_FORMAT_POLY,
         "8 3 0 0\n0 0 0 0\n1 3 0 0\n2 3 3 0\n3 0 3 0\n4 1 1 0\n5 2 1 0\n6 2 2 0\n7 1 2 0\n1 1\n"
         "2 1 7\n4 0 1 2 3\n4 4 5 6 7\n1 1.5 1.5 0\n1\n1 0 0 0\n1\n1 0 0 0 1 1\n"}};
    size_t k;
    for (k = 0; k < sizeof files / sizeof files[0]; k++) {
        long tries;
        meshio_result result = MESHIO_ERROR_OUT_OF_MEMORY;
        for (tries = 0; tries < 200 && result != MESHIO_OK; tries++) {
            meshio_mesh m;
            allocations = 0;
            fail_at = tries;
            result = read_text(files[k].format, files[k].text, &m, NULL);
            CHECK(result == MESHIO_OK || result == MESHIO_ERROR_OUT_OF_MEMORY);
            meshio_free(&m);
            CHECK(live_blocks == 0);
        }
        fail_at = -1;
        CHECK(result == MESHIO_OK && tries > 3);
    }
}

static void write_errors_are_reported(void)
{
    meshio_mesh m = sample();
    meshio_report report;
    size_t size;
    char *bytes;
    FILE *f;
    CHECK(meshio_write("no such folder/a.mesh", &m, NULL, &report) == MESHIO_ERROR_WRITE);
    CHECK(strstr(report.message, "no such folder") != NULL);
    CHECK(meshio_write(file_name("xyzw"), &m, NULL, &report) == MESHIO_ERROR_FORMAT);
    CHECK(meshio_write(NULL, &m, NULL, &report) == MESHIO_ERROR_INVALID_ARGUMENT);
    if (exists("/dev/full")) {
        CHECK(meshio_write("/dev/full", &m, NULL, &report) == MESHIO_ERROR_FORMAT);
        {
            meshio_write_options options;
            memset(&options, 0, sizeof options);
            options.format = MESHIO_FORMAT_MEDIT;
            CHECK(meshio_write("/dev/full", &m, &options, &report) == MESHIO_ERROR_WRITE);
            CHECK(exists("/dev/full"));
        }
    }
    /* out of memory while writing: the older file stays, nothing is left beside it */
    f = fopen(file_name("msh4"), "wb");
    fputs("older", f);
    fclose(f);
    allocations = 0;
    fail_at = 2;
    CHECK(meshio_write(file_name("msh4"), &m, NULL, &report) == MESHIO_ERROR_OUT_OF_MEMORY);
    CHECK(report.result == MESHIO_ERROR_OUT_OF_MEMORY && strstr(report.message, "msh4"));
    fail_at = -1;
    bytes = load(file_name("msh4"), &size);
    CHECK(bytes && size == 5 && memcmp(bytes, "older", 5) == 0);
    free(bytes);
    CHECK(!exists(file_name("msh4.part")));
    remove(file_name("msh4"));
    for (fail_at = 0; fail_at < 7; fail_at++) {
        allocations = 0;
        CHECK(meshio_write(file_name("inp"), &m, NULL, &report) == MESHIO_ERROR_OUT_OF_MEMORY);
        CHECK(!exists(file_name("inp")) && !exists(file_name("inp.part")));
    }
    fail_at = -1;
    CHECK(live_blocks == 0);
}

/* The arrays are not looked at. */
static void counts_beyond_32_bits_are_refused(void)
{
    static const char *const extensions[] = {"meshb", "msh", "vtk"};
    meshio_write_options options;
    meshio_report report;
    size_t i;
    int k;
    memset(&options, 0, sizeof options);
    options.binary = 1;
    for (i = 0; i < 3; i++)
        for (k = 0; k < (i < 2 ? 4 : 1); k++) {
            meshio_mesh m;
            size_t *counts[4];
            memset(&m, 0, sizeof m);
            counts[0] = &m.num_vertices, counts[1] = &m.num_edges;
            counts[2] = &m.num_triangles, counts[3] = &m.num_tets;
            *counts[k] = 0x80000000u;
            CHECK(meshio_write(file_name(extensions[i]), &m, &options, &report) ==
                  MESHIO_ERROR_TOO_LARGE);
            CHECK(report.result == MESHIO_ERROR_TOO_LARGE &&
                  strstr(report.message, "more vertices"));
            CHECK(!exists(file_name(extensions[i])));
        }
    {
        meshio_mesh m;
        memset(&m, 0, sizeof m);
        m.num_edges = m.num_tets = 0x40000000u;
        CHECK(meshio_write(file_name("msh"), &m, &options, &report) == MESHIO_ERROR_TOO_LARGE);
        m.num_edges = 0, m.num_tets = 0;
        CHECK(meshio_write(file_name("msh"), &m, &options, &report) == MESHIO_OK);
        remove(file_name("msh"));
    }
}

static void names_that_cannot_be_written_are_refused(void)
{
    static const char *const bad[] = {"", "a b", "a\tb", "\"", "a&b", "<", "a>"};
    char longest[102];
    meshio_mesh m;
    meshio_field field;
    meshio_write_options options;
    meshio_report report;
    size_t i;
    memset(&m, 0, sizeof m);
    memset(&field, 0, sizeof field);
    memset(&options, 0, sizeof options);
    memset(longest, 'n', sizeof longest);
    options.fields = &field;
    options.num_fields = 1;
    for (i = 0; i < sizeof bad / sizeof bad[0] + 3; i++) {
        const char *extension = i % 2 ? "vtu" : "vtk";
        int is_good = i == sizeof bad / sizeof bad[0] + 2;
        longest[is_good ? 100 : 101] = 0;
        field.name = i < sizeof bad / sizeof bad[0] ? bad[i]
                     : i == sizeof bad / sizeof bad[0] ? NULL : longest;
        CHECK(meshio_write(file_name(extension), &m, &options, &report) ==
              (is_good ? MESHIO_OK : MESHIO_ERROR_INVALID_ARGUMENT));
        CHECK(exists(file_name(extension)) == is_good);
        CHECK(is_good == (report.message[0] == 0));
    }
    remove(file_name("vtk"));
    m.second_order = 1;
    CHECK(meshio_write(file_name("ele"), &m, NULL, &report) == MESHIO_ERROR_FORMAT &&
          strstr(report.message, "no second-order elements"));
}

static void read_errors_are_reported(void)
{
    meshio_mesh m;
    meshio_report report;
    CHECK(meshio_read("no such file.off", MESHIO_FORMAT_AUTO, &m, &report) == MESHIO_ERROR_OPEN);
    CHECK(strstr(report.message, "no such file.off") != NULL);
    CHECK(meshio_read("a.xyzw", MESHIO_FORMAT_AUTO, &m, &report) == MESHIO_ERROR_FORMAT);
    CHECK(meshio_read("noextension", MESHIO_FORMAT_AUTO, &m, &report) == MESHIO_ERROR_FORMAT);
    CHECK(meshio_read(NULL, MESHIO_FORMAT_OFF, &m, &report) == MESHIO_ERROR_INVALID_ARGUMENT);
    CHECK(meshio_read("tests", MESHIO_FORMAT_OFF, &m, &report) != MESHIO_OK);
    CHECK(meshio_read_memory(NULL, 0, MESHIO_FORMAT_OFF, &m, &report) == MESHIO_ERROR_TRUNCATED);
    CHECK(meshio_read_memory(NULL, 1, MESHIO_FORMAT_OFF, &m, &report) ==
          MESHIO_ERROR_INVALID_ARGUMENT);
}

static void failures_have_a_sentence_however_early(void)
{
    meshio_mesh m = sample(), back;
    meshio_report report;
    CHECK(meshio_read(NULL, MESHIO_FORMAT_OFF, &back, &report) == MESHIO_ERROR_INVALID_ARGUMENT &&
          report.message[0] && report.result == MESHIO_ERROR_INVALID_ARGUMENT);
    CHECK(meshio_read("a.off", MESHIO_FORMAT_OFF, NULL, &report) == MESHIO_ERROR_INVALID_ARGUMENT &&
          report.message[0]);
    CHECK(meshio_read_memory(NULL, 1, MESHIO_FORMAT_OFF, &back, &report) ==
              MESHIO_ERROR_INVALID_ARGUMENT && report.message[0]);
    CHECK(meshio_read_memory("", (size_t)-1, MESHIO_FORMAT_OFF, &back, &report) ==
              MESHIO_ERROR_INVALID_ARGUMENT && report.message[0]);
    CHECK(meshio_read_memory("", 0, MESHIO_FORMAT_AUTO, &back, &report) ==
              MESHIO_ERROR_INVALID_ARGUMENT && report.message[0]);
    CHECK(meshio_write(NULL, &m, NULL, &report) == MESHIO_ERROR_INVALID_ARGUMENT &&
          report.message[0]);
    CHECK(meshio_write("a.off", NULL, NULL, &report) == MESHIO_ERROR_INVALID_ARGUMENT &&
          report.message[0]);
    allocations = fail_at = 0;
    CHECK(meshio_read_memory("OFF", 3, MESHIO_FORMAT_OFF, &back, &report) ==
              MESHIO_ERROR_OUT_OF_MEMORY && report.message[0]);
    allocations = 0;
    CHECK(meshio_write(file_name("off"), &m, NULL, &report) == MESHIO_ERROR_OUT_OF_MEMORY &&
          report.message[0] && report.result == MESHIO_ERROR_OUT_OF_MEMORY);
    fail_at = -1;
}

/* Writes a text into a file of this extension and reads two sizes from it. */
static meshio_result sizes_of(const char *extension, const char *text, double *sizes,
                              meshio_report *report)
{
    FILE *f = fopen(file_name(extension), "wb");
    meshio_result result;
    CHECK(f && fputs(text, f) >= 0 && fclose(f) == 0);
    sizes[0] = sizes[1] = -1;
    result = meshio_read_sizes(file_name(extension), sizes, 2, report);
    remove(file_name(extension));
    return result;
}

static void sizes_are_read_beside_a_mesh(void)
{
    static const struct {
        const char *extension, *text;
        meshio_result result;
        const char *message;
    } bad[] = {
        {"sol", "MeshVersionFormatted 2 Dimension 3 SolAtVertices 3 1 1 1 1 1", MESHIO_ERROR_COUNT,
         "3 values for a mesh of 2 vertices"},
        {"sol", "MeshVersionFormatted 2 Dimension 3\nSolAtVertices 2 1 3", MESHIO_ERROR_UNSUPPORTED,
         "line 2: not one scalar"},
        {"sol", "MeshVersionFormatted 2 Dimension 3 SolAtVertices 2 2 1 1",
         MESHIO_ERROR_UNSUPPORTED, "not one scalar"},
        {"sol", "MeshVersionFormatted 2 Dimension 2 SolAtVertices 2 1 1", MESHIO_ERROR_UNSUPPORTED,
         "only Dimension 3"},
        {"sol", "MeshVersionFormatted 2 Dimension 3 Vertices 2", MESHIO_ERROR_SYNTAX,
         "expected 'solatvertices', found 'Vertices'"},
        {"sol", "MeshVersionFormatted 2 Dimension 3 SolAtVertices 2 1 1\n1", MESHIO_ERROR_TRUNCATED,
         "line 2: the file ends where a number is due"},
        {"mtr", "2 1\n1\n2\n3\n", MESHIO_ERROR_SYNTAX, "line 4: expected the end of the file"},
        {"mtr", "2 6\n1 0 1 0 0 1\n1 0 1 0 0 1\n", MESHIO_ERROR_UNSUPPORTED,
         "line 1: 6 numbers a vertex"},
        {"mtr", "1 1\n1\n", MESHIO_ERROR_COUNT, "1 values"},
        {"mtr", "2 1\n1\nx\n", MESHIO_ERROR_SYNTAX, "line 3: expected a number, found 'x'"},
        {"mtr", "", MESHIO_ERROR_TRUNCATED, "the file ends where an integer is due"},
        {"txt", "2 1\n1\n2\n", MESHIO_ERROR_FORMAT, "unknown extension"}};
    double sizes[2];
    meshio_report report;
    size_t i;
    CHECK(sizes_of("sol", "MeshVersionFormatted 2\n# by hand\nDimension\n3\nSolAtVertices\n2\n1 1\n"
                          "0.25\n1e-3\nEnd\n", sizes, &report) == MESHIO_OK);
    CHECK(sizes[0] == 0.25 && sizes[1] == 1e-3 && report.message[0] == 0);
    CHECK(sizes_of("MTR", "# two\n2 1\r\n3\r\n0\r\n", sizes, NULL) == MESHIO_OK);
    CHECK(sizes[0] == 3 && sizes[1] == 0);
    for (i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        CHECK(sizes_of(bad[i].extension, bad[i].text, sizes, &report) == bad[i].result);
        CHECK(report.result == bad[i].result && strstr(report.message, bad[i].message));
    }
    CHECK(meshio_read_sizes(file_name("sol"), sizes, 2, &report) == MESHIO_ERROR_OPEN);
    CHECK(meshio_read_sizes(NULL, sizes, 2, &report) == MESHIO_ERROR_INVALID_ARGUMENT);
    CHECK(live_blocks == 0);
}

static void sizes_are_written_to_every_bit(void)
{
    static const char *const extensions[2] = {"sol", "mtr"};
    const double sizes[3] = {0.1, 1e-300, 123456789.123456789};
    double back[3];
    meshio_report report;
    int k;
    for (k = 0; k < 2; k++) {
        const char *name = file_name(extensions[k]);
        CHECK(meshio_write_sizes(name, sizes, 3, &report) == MESHIO_OK && !report.message[0]);
        memset(back, 0, sizeof back);
        CHECK(meshio_read_sizes(name, back, 3, &report) == MESHIO_OK);
        CHECK(memcmp(sizes, back, sizeof sizes) == 0);
        CHECK(meshio_write_sizes(name, NULL, 0, NULL) == MESHIO_OK);
        CHECK(meshio_read_sizes(name, NULL, 0, NULL) == MESHIO_OK);
        remove(name);
    }
    CHECK(meshio_write_sizes("a.txt", sizes, 3, &report) == MESHIO_ERROR_FORMAT);
    CHECK(meshio_write_sizes("missing/a.sol", sizes, 3, &report) == MESHIO_ERROR_WRITE);
    CHECK(meshio_write_sizes("a.sol", NULL, 3, &report) == MESHIO_ERROR_INVALID_ARGUMENT);
    allocations = fail_at = 0;
    CHECK(meshio_write_sizes("a.sol", sizes, 3, &report) == MESHIO_ERROR_OUT_OF_MEMORY);
    fail_at = -1;
    CHECK(live_blocks == 0);
}

/* Corners whose products, or the rounding errors of these, are below the smallest double: the sweep
 * over the corners of such a polygon has the right signs all the same. */
static void polygons_with_tiny_coordinates_are_read(void)
{
    static const char text[] = "OFF\n6 1 0\n0 0 0\n1 0 5\n0.1 0.3333333333333333 0\n0 0 1e-300\n"
                               "1e38 0 12345678.9\n-1 2e-308 5e-324\n6 5 1 2 3 4 0\n";
    static const double scales[] = {1, 1e-100, 1e-124, 1e-140, 1e-160, 1e-300, 5e-324};
    char many[2000];
    meshio_mesh m;
    uint64_t state = 1;
    int k, i;
    CHECK(meshio_read_memory(text, sizeof text - 1, MESHIO_FORMAT_OFF, &m, NULL) == MESHIO_OK);
    CHECK(m.num_triangles == 4);
    meshio_free(&m);
    for (k = 0; k < 20000; k++) {
        int length = snprintf(many, sizeof many, "OFF\n8 1 0\n");
        for (i = 0; i < 24; i++) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            length += snprintf(many + length, sizeof many - (size_t)length, "%.17g%c",
                               ((double)(state >> 60) - 7) * scales[(state >> 40) % 7],
                               i % 3 == 2 ? '\n' : ' ');
        }
        length += snprintf(many + length, sizeof many - (size_t)length, "8 0 1 2 3 4 5 6 7\n");
        CHECK(meshio_read_memory(many, (size_t)length, MESHIO_FORMAT_OFF, &m, NULL) == MESHIO_OK);
        meshio_free(&m);
    }
    CHECK(live_blocks == 0);
}

static void every_status_has_words(void)
{
    int i;
    for (i = MESHIO_ERROR_WRITE; i <= 0; i++)
        if (i == 0 || i == -1 || i == -2 || i == -4 || i <= -96)
            CHECK(strcmp(meshio_result_string((meshio_result)i), "unknown status") != 0);
    CHECK(meshio_format_of("a/b.STL") == MESHIO_FORMAT_STL &&
          meshio_format_of("mesh") == MESHIO_FORMAT_AUTO);
}

int main(void)
{
    doubles_are_correctly_rounded();
    halfway_cases_are_rounded_to_even();
    fortran_exponents_are_like_others();
    doubles_are_written_like_printf();
    text_does_not_depend_on_threads();
    words_are_not_numbers();
    numbers_may_be_infinite_or_none();
    volume_formats_keep_every_bit();
    faces_beside_elements();
    inp_keeps_regions_and_surfaces();
    inp_has_elements_of_ten_nodes();
    inp_surfaces_are_on_one_side();
    inp_is_read_as_others_write_it();
    inp_parts_have_their_places();
    inp_sets_have_numbers();
    inp_elements_have_kinds();
    inp_lines_of_three_nodes_have_the_second_in_the_middle();
    inp_refuses_what_it_does_not_know();
    surface_formats_keep_the_triangles();
    stl_is_written_in_little_endian_order();
    binary_stl_has_no_infinite_coordinates();
    points_are_read_raw_and_as_text();
    off_comes_in_many_layouts();
    lines_may_end_with_a_carriage_return();
    ply_text_comes_in_many_layouts();
    incomplete_lines_are_named();
    obj_indices_come_in_many_forms();
    ply_elements_come_in_any_order();
    ply_data_may_begin_with_a_line_feed();
    ply_may_go_on();
    thin_faces_are_counted();
    ply_strips_are_triangles();
    medit_keywords_come_in_any_order();
    medit_curved_elements_are_their_corners();
    medit_lines_may_end_anywhere();
    msh_ids_may_be_sparse();
    msh_has_several_versions();
    msh_groups_have_signs();
    msh_elements_are_not_repeated();
    msh_tells_what_is_left_out();
    msh_sizes_may_have_32_bits();
    vtk_cells_and_strips();
    vtk_has_fields_and_metadata();
    vtk_binary_fields_are_stepped_over();
    vtk_curved_cells_are_their_corners();
    vtu_data_may_be_compressed();
    vtu_data_may_be_encoded();
    vtu_tags_may_be_of_any_style();
    torn_encoded_data_never_crash();
    stl_text_may_hold_several_solids();
    stl_normals_may_be_anything();
    stl_text_may_end_after_a_facet();
    off_may_go_on();
    stl_binary_is_known_by_its_size();
    stl_binary_may_hold_several_solids();
    msh_names_are_read_and_written();
    facets_may_be_concave_and_have_holes();
    facets_may_begin_with_a_segment();
    facets_may_have_many_holes();
    large_facets_are_recovered();
    polygons_may_be_concave();
    other_polygons_are_fans();
    poly_keeps_seeds_and_markers();
    poly_facets_may_be_segments();
    tetgen_lists_have_their_length();
    poly_finds_the_nodes_beside_it();
    coordinates_may_be_indefinite();
    damaged_texts_get_a_status_and_a_line();
    lying_binary_files_are_refused();
    torn_files_never_crash();
    torn_texts_never_crash();
    every_failing_allocation_is_reported();
    write_errors_are_reported();
    counts_beyond_32_bits_are_refused();
    read_errors_are_reported();
    names_that_cannot_be_written_are_refused();
    failures_have_a_sentence_however_early();
    sizes_are_read_beside_a_mesh();
    sizes_are_written_to_every_bit();
    polygons_with_tiny_coordinates_are_read();
    every_status_has_words();
    return check_report();
}
