/* reconnect.c - the closure search on cavities of a random Delaunay mesh, grown around its
 * worst tetrahedra
 *
 * In the manner of [Marot 2020, table 6.1]: the time to the proven optimum with and without an
 * initial bound (the worst quality in the cavity as it is), and the gain from each heuristic (each
 * is switched off by the search's flags). Quality is gamma = sqrt(24) * inradius / longest edge.
 * Columns: points; kind of search; cavities; boundary triangles (mean); cavities whose worst
 * quality was improved; nodes (mean); microseconds (mean, median); searches that reached the node
 * limit; nanoseconds per node. Last: the cost of a growing cavity [Marot 2020, 6.3], with a search
 * at each size from 5 points on until one improves.
 *
 *     make bench-reconnect ARGS="[points of the mesh] [cavities of each size] [largest size]
 *                                [node limit] [1: points of a jittered grid]"
 */
#define DELAUNAY_IMPLEMENTATION
#include "../delaunay.h"

enum { MAX_CAVITIES = 1000 };

/* Positive tetrahedra only; the same bits for any order of the points would need sorted sums: the
 * search asks once a tetrahedron, always in the same order. */
static double gamma_quality(void *user, const double *a, const double *b, const double *c,
                            const double *d)
{
    const double *p[4];
    double u[3][3], longest = 0, area = 0, det, n[3];
    int i, j, k;
    (void)user;
    p[0] = a;
    p[1] = b;
    p[2] = c;
    p[3] = d;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++) u[i][k] = p[i + 1][k] - a[k];
    det = u[0][0] * (u[1][1] * u[2][2] - u[1][2] * u[2][1]) +
          u[0][1] * (u[1][2] * u[2][0] - u[1][0] * u[2][2]) +
          u[0][2] * (u[1][0] * u[2][1] - u[1][1] * u[2][0]);
    for (i = 0; i < 4; i++)
        for (j = 0; j < i; j++) {
            double l = 0;
            for (k = 0; k < 3; k++) l += (p[i][k] - p[j][k]) * (p[i][k] - p[j][k]);
            if (l > longest) longest = l;
        }
    for (i = 0; i < 4; i++) {
        const double *q = p[delaunay_facet_order(i)[0]], *r = p[delaunay_facet_order(i)[1]],
                     *s = p[delaunay_facet_order(i)[2]];
        for (k = 0; k < 3; k++)
            n[k] = (r[(k + 1) % 3] - q[(k + 1) % 3]) * (s[(k + 2) % 3] - q[(k + 2) % 3]) -
                   (r[(k + 2) % 3] - q[(k + 2) % 3]) * (s[(k + 1) % 3] - q[(k + 1) % 3]);
        area += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
    }
    return det / 6 * 3 * sqrt(24.0) / (sqrt(longest) * area);
}

static double tet_quality(const delaunay_mesh *m, delaunay_handle t)
{
    const uint32_t *v = m->tets[t].v;
    return gamma_quality(NULL, m->vertices[v[0]].x, m->vertices[v[1]].x, m->vertices[v[2]].x,
                         m->vertices[v[3]].x);
}

typedef struct cavity {
    delaunay_handle tets[DELAUNAY_WINDOW_TETS];
    size_t          num_tets;
    uint32_t        vertices[32], num_vertices;
} cavity;

static int in_cavity(const cavity *c, delaunay_handle t)
{
    size_t i;
    for (i = 0; i < c->num_tets; i++)
        if (c->tets[i] == t) return 1;
    return 0;
}

static int has_vertex(const cavity *c, uint32_t v)
{
    uint32_t i;
    for (i = 0; i < c->num_vertices; i++)
        if (c->vertices[i] == v) return 1;
    return 0;
}

/* Adds the vertex that most outer neighbours have, the worst neighbours among equals; then every
 * neighbour with all its vertices inside. 0: cannot grow. */
static int grow(const delaunay_mesh *m, cavity *c)
{
    uint32_t apex[512], num = 0, best = 0, i, k;
    int count[512];
    double sum[512];
    size_t j;
    for (j = 0; j < c->num_tets; j++)
        for (k = 0; k < 4; k++) {
            delaunay_handle h = m->tets[c->tets[j]].n[k];
            if (!h || in_cavity(c, h / 4)) continue;
            if (delaunay_is_ghost(m, h / 4)) continue;
            for (i = 0; i < num && apex[i] != m->tets[h / 4].v[h % 4]; i++) {}
            if (i == 512) return 0;
            if (i == num) {
                apex[num] = m->tets[h / 4].v[h % 4];
                count[num] = 0;
                sum[num++] = 0;
            }
            count[i]++;
            sum[i] += tet_quality(m, h / 4);
        }
    if (!num) return 0;
    for (i = 1; i < num; i++)
        if (count[i] > count[best] || (count[i] == count[best] && sum[i] < sum[best])) best = i;
    c->vertices[c->num_vertices++] = apex[best];
    for (j = 0; j < c->num_tets; j++)
        for (k = 0; k < 4; k++) {
            delaunay_handle h = m->tets[c->tets[j]].n[k];
            if (!h || delaunay_is_ghost(m, h / 4) || in_cavity(c, h / 4) ||
                !has_vertex(c, m->tets[h / 4].v[h % 4]))
                continue;
            if (c->num_tets == DELAUNAY_WINDOW_TETS) return 0;
            c->tets[c->num_tets++] = h / 4;
        }
    return 1;
}

static void cavity_start(const delaunay_mesh *m, cavity *c, delaunay_handle t)
{
    c->tets[0] = t;
    c->num_tets = 1;
    c->num_vertices = 4;
    memcpy(c->vertices, m->tets[t].v, sizeof m->tets[t].v);
}

static double worst_of(const delaunay_mesh *m, const cavity *c)
{
    double q = 1;
    size_t i;
    for (i = 0; i < c->num_tets; i++)
        if (tet_quality(m, c->tets[i]) < q) q = tet_quality(m, c->tets[i]);
    return q;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

typedef struct bench {
    delaunay_mesh    mesh;
    delaunay_worker *worker;
    delaunay_handle  worst[MAX_CAVITIES];
    size_t           num_worst;
    uint32_t         max_nodes;
} bench;

static void run_size(bench *b, uint32_t size, const char *what, int bounded, uint32_t flags)
{
    static delaunay_window window;
    static delaunay_search search;
    static double times[MAX_CAVITIES];
    double total = 0, facets = 0, nodes = 0;
    size_t i, done = 0, improved = 0, limited = 0;
    for (i = 0; i < b->num_worst; i++) {
        cavity c;
        double start, bound;
        int grown = 1, rep;
        cavity_start(&b->mesh, &c, b->worst[i]);
        while (grown && c.num_vertices < size) grown = grow(&b->mesh, &c);
        if (!grown) continue;
        bound = worst_of(&b->mesh, &c);
        times[done] = 1e300;
        for (rep = 0; rep < (size <= 14 ? 5 : 1);
             rep++) { /* tables forgotten: another window comes between */
            delaunay_window_set(&window, &b->mesh, &b->worst[(i + 1) % b->num_worst], 1, 32,
                                0, 0);
            memset(&search, 0, sizeof search);
            search.objective = DELAUNAY_ANY;
            delaunay_reconnect(&b->mesh, b->worker, &window, &search);
            memset(&search, 0, sizeof search);
            search.objective = DELAUNAY_BEST_QUALITY;
            search.quality = gamma_quality;
            search.bound = bounded ? bound : 0;
            search.flags = flags;
            search.max_nodes = b->max_nodes;
            start = delaunay_seconds(NULL);
            delaunay_window_set(&window, &b->mesh, c.tets, c.num_tets, 32, 0, 0);
            delaunay_reconnect(&b->mesh, b->worker, &window, &search);
            start = (delaunay_seconds(NULL) - start) * 1e6;
            if (start < times[done]) times[done] = start;
        }
        total += times[done++];
        facets += window.num_facets;
        nodes += search.nodes;
        limited += !search.proven;
        improved += search.num_tets > 0 && search.value > bound;
    }
    if (!done) return;
    qsort(times, done, sizeof *times, ascending);
    printf("%u,%s,%lu,%.0f,%lu,%.0f,%.1f,%.1f,%lu,%.1f\n", size, what, (unsigned long)done,
           facets / (double)done, (unsigned long)improved, nodes / (double)done,
           total / (double)done, times[done / 2], (unsigned long)limited, 1e3 * total / nodes);
    fflush(stdout);
}

/* A search at each size until one improves; tables are carried from size to size. */
static void run_growing(bench *b, uint32_t largest, uint32_t flags, uint32_t max_nodes)
{
    static delaunay_window window;
    static delaunay_search search;
    double start = delaunay_seconds(NULL), points = 0, nodes = 0;
    size_t i, improved = 0, searches = 0;
    for (i = 0; i < b->num_worst; i++) {
        cavity c;
        cavity_start(&b->mesh, &c, b->worst[i]);
        while (c.num_vertices < largest && grow(&b->mesh, &c)) {
            memset(&search, 0, offsetof(delaunay_search, tets));
            search.objective = DELAUNAY_BEST_QUALITY;
            search.quality = gamma_quality;
            search.bound = worst_of(&b->mesh, &c);
            search.flags = flags;
            search.max_nodes = max_nodes;
            delaunay_window_set(&window, &b->mesh, c.tets, c.num_tets, 32, 0, 0);
            searches++;
            if (delaunay_reconnect(&b->mesh, b->worker, &window, &search)) break;
            nodes += search.nodes;
        }
        nodes += search.nodes;
        points += c.num_vertices;
        improved += search.num_tets > 0;
    }
    start = delaunay_seconds(NULL) - start;
    printf("growing to %u points: %lu cavities, %lu improved, %.1f searches, %.1f points, %.0f "
           "nodes, %.1f us each\n",
           largest, (unsigned long)b->num_worst, (unsigned long)improved,
           (double)searches / (double)b->num_worst, points / (double)b->num_worst,
           nodes / (double)b->num_worst, 1e6 * start / (double)b->num_worst);
}

/* n random points in the unit cube; if spread is set, one in each cell of a lattice, and *n may
 * become smaller. NULL: out of memory. */
static double *random_points(size_t *n, int spread)
{
    double *xyz = (double *)malloc(3 * *n * sizeof *xyz);
    uint64_t state = 88172645463325252u;
    size_t side = (size_t)cbrt((double)*n + 0.5), i; /* rounds down: not more points */
    if (!xyz) return NULL;
    for (i = 0; i < 3 * *n; i++) {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        xyz[i] = (double)(state >> 11) / 9007199254740992.0;
    }
    if (!spread) return xyz;
    *n = side * side * side;
    for (i = 0; i < 3 * *n; i++) {
        size_t cell = i % 3 == 0   ? i / 3 % side
                      : i % 3 == 1 ? i / 3 / side % side
                                   : i / 3 / side / side;
        xyz[i] = ((double)cell + 0.7 * xyz[i]) / (double)side;
    }
    return xyz;
}

/* Lists tetrahedra with qualities between low and high, away from the border. */
static void find_bad(bench *b, size_t most, double low, double high)
{
    delaunay_handle t;
    for (t = 1; t < b->mesh.num_tets && b->num_worst < most; t++) {
        double q, lo = 1, hi = 0;
        int k;
        if (delaunay_is_deleted(&b->mesh, t) || delaunay_is_ghost(&b->mesh, t)) continue;
        for (k = 0; k < 12; k++) {
            double x = b->mesh.vertices[b->mesh.tets[t].v[k / 3]].x[k % 3];
            if (x < lo) lo = x;
            if (x > hi) hi = x;
        }
        q = tet_quality(&b->mesh, t);
        if (q > low && q < high && lo > 0.15 && hi < 0.85) b->worst[b->num_worst++] = t;
    }
}

int main(int argc, char **argv)
{
    static bench b;
    static const uint32_t sizes[] = {8, 10, 12, 14, 16, 18, 20, 22, 24, 28, 32};
    size_t n = argc > 1 ? (size_t)atol(argv[1]) : 20000,
           cavities = argc > 2 ? (size_t)atol(argv[2]) : 60, i;
    uint32_t largest = argc > 3 ? (uint32_t)atol(argv[3]) : 18;
    const int spread = argc > 5 && atoi(argv[5]);
    double *xyz = random_points(&n, spread);
    b.max_nodes = argc > 4 ? (uint32_t)atol(argv[4]) : 300000;
    if (!xyz || cavities > MAX_CAVITIES) return 1;
    if (delaunay_tetrahedralize(&b.mesh, xyz, n, NULL, NULL) != DELAUNAY_OK) return 1;
    b.worker = delaunay_worker_new(&b.mesh.memory);
    if (!b.worker) return 1;
    find_bad(&b, cavities, spread ? 0.2 : 0, spread ? 0.3 : 0.2);
    printf("points,search,cavities,facets,improved,nodes,mean_us,median_us,limited,ns_per_node\n");
    for (i = 0; i < sizeof sizes / sizeof *sizes && sizes[i] <= largest; i++) {
        run_size(&b, sizes[i], "bounded", 1, 0);
        run_size(&b, sizes[i], "unbounded", 0, 0);
        if (sizes[i] > 16) continue;
        run_size(&b, sizes[i], "any facet", 1, DELAUNAY_SEARCH_ANY_FACET);
        run_size(&b, sizes[i], "any order", 1, DELAUNAY_SEARCH_ANY_ORDER);
        run_size(&b, sizes[i], "no memory", 1, DELAUNAY_SEARCH_NO_MEMORY);
    }
    run_growing(&b, 12, 0, 1000);
    run_growing(&b, 16, 0, 1000);
    run_growing(&b, 32, 0, 500);
    delaunay_worker_free(b.worker);
    delaunay_mesh_free(&b.mesh);
    free(xyz);
    return 0;
}
