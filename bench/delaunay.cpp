/* delaunay.cpp - delaunay.h compared with CGAL, in turns in one process; CSV on stdout.
 *
 *   cc -O3 -fopenmp -DDELAUNAY_IMPLEMENTATION -include delaunay.h -x c -c /dev/null -o ours.o
 *   c++ -O3 -march=native -frounding-math -fopenmp -DBENCH_DELAUNAY_SEPARATE -DWITH_CGAL -I. \
 *       bench/delaunay.cpp ours.o -o bench_delaunay -ltbb -ltbbmalloc -lgmp -lmpfr -lm
 *   (apt-get install libcgal-dev libtbb-dev)
 *
 * In this way ours is compiled with the flags of the README, and the rival with those that are best
 * for it. Without -DWITH_CGAL and -DBENCH_DELAUNAY_SEPARATE the file builds alone, and the rival's
 * times are nan.
 *
 * Columns: bench,case,threads,ours_s,rival,rival_s,ratio; ratio = rival_s/ours_s; all are medians.
 * The times are from points in memory to the triangulation, with sorting and numbering, but without
 * input, output and freeing. Environment: QUICK=1: fewer and smaller cases. THREADS="1 2 4 8 16":
 * instead of the cases, POINTS (default 10 million) uniform points with each of these numbers of
 * threads, RUNS (default 3) runs each, compared with one thread and with CGAL in parallel. */
#ifndef BENCH_DELAUNAY_SEPARATE
#  define DELAUNAY_IMPLEMENTATION
#endif
#include "delaunay.h"
#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>
#ifdef __GLIBC__
#  include <malloc.h>
#endif
#ifdef WITH_CGAL
#  define CGAL_LINKED_WITH_TBB
#  include <CGAL/Delaunay_triangulation_3.h>
#  include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#  include <tbb/global_control.h>
typedef CGAL::Exact_predicates_inexact_constructions_kernel K;
typedef CGAL::Delaunay_triangulation_3<K> Serial;
typedef CGAL::Triangulation_data_structure_3<CGAL::Triangulation_vertex_base_3<K>,
                                             CGAL::Delaunay_triangulation_cell_base_3<K>,
                                             CGAL::Parallel_tag>
    Parallel_structure;
typedef CGAL::Delaunay_triangulation_3<K, Parallel_structure> Parallel;
#endif

/* Of one thread the processor's time, so that other programs do not count; of more the clock's. */
static double now(int threads)
{
    if (threads == 1) return (double)clock() / (double)CLOCKS_PER_SEC;
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

static uint64_t random_state = 1;
static double random_unit()
{
    uint64_t x = random_state += UINT64_C(0x9e3779b97f4a7c15);
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    x ^= x >> 31;
    return (double)(x >> 11) / 9007199254740992.0;
}

static std::vector<double> make_points(const std::string &kind, size_t n)
{
    std::vector<double> xyz(3 * n);
    double centre[100][3];
    size_t side = 1, i;
    for (i = 0; i < 300; i++) centre[i / 3][i % 3] = random_unit();
    while (side * side * side < n) side++;
    for (i = 0; i < n; i++) {
        double *x = &xyz[3 * i], a, b, q;
        for (int k = 0; k < 3; k++) x[k] = random_unit();
        if (kind == "clusters")
            for (int k = 0; k < 3; k++)
                x[k] = centre[i % 100][k] + 0.01 * std::sqrt(-2 * std::log(x[k] + 1e-300)) *
                                                std::cos(6.283185307179586 * random_unit());
        if (kind == "sphere") {
            do a = 2 * random_unit() - 1, b = 2 * random_unit() - 1, q = a * a + b * b;
            while (q >= 1);
            x[0] = 2 * a * std::sqrt(1 - q), x[1] = 2 * b * std::sqrt(1 - q), x[2] = 1 - 2 * q;
        }
        if (kind == "grid" || kind == "grid-decimal")
            x[0] = (double)(i % side), x[1] = (double)(i / side % side),
            x[2] = (double)(i / side / side);
        if (kind == "grid-decimal")
            for (int k = 0; k < 3; k++) x[k] = x[k] * 0.1 + 0.3;
        if (kind == "lines") {
            double t = x[0];
            x[0] = i & 1 ? t : 0, x[1] = i & 1 ? 0 : t, x[2] = i & 1 ? 1 : 0;
        }
    }
    return xyz;
}

static double run_ours(const std::vector<double> &xyz, int threads, int any_order, size_t *peak,
                       delaunay_report *phases = NULL)
{
    delaunay_mesh mesh;
    delaunay_options options;
    delaunay_report report;
    memset(&mesh, 0, sizeof mesh);
    memset(&options, 0, sizeof options);
    options.host.num_threads = threads;
    options.any_order = any_order;
    double start = now(threads);
    if (delaunay_tetrahedralize(&mesh, xyz.data(), xyz.size() / 3, &options, &report) !=
        DELAUNAY_OK) {
        fprintf(stderr, "bench_delaunay: %s\n", report.message);
        exit(1);
    }
    double seconds = now(threads) - start;
    *peak = report.peak_bytes;
    if (phases) *phases = report;
    delaunay_mesh_free(&mesh);
    return seconds;
}

#ifdef WITH_CGAL
static double run_cgal(const std::vector<double> &xyz, int threads)
{
    std::vector<K::Point_3> points(xyz.size() / 3);
    double least[3], most[3];
    for (size_t i = 0; i < points.size(); i++)
        points[i] = K::Point_3(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
    for (int k = 0; k < 3; k++) least[k] = most[k] = xyz[k];
    for (size_t i = 0; i < xyz.size(); i++) {
        least[i % 3] = std::min(least[i % 3], xyz[i]);
        most[i % 3] = std::max(most[i % 3], xyz[i]);
    }
    double start = now(threads);
    if (threads == 1) {
        Serial t(points.begin(), points.end());
        return now(threads) - start;
    }
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, (size_t)threads);
    Parallel::Lock_data_structure locks(
        CGAL::Bbox_3(least[0], least[1], least[2], most[0], most[1], most[2]), 50);
    Parallel t(points.begin(), points.end(), &locks);
    return now(threads) - start;
}
#endif

/* Peak memory of the process so far in bytes; 0 where the system does not say. */
static double peak_of_process()
{
    std::ifstream status("/proc/self/status");
    std::string word;
    double kilobytes = 0;
    while (status >> word)
        if (word == "VmHWM:") status >> kilobytes;
    return 1024 * kilobytes;
}

static double median(std::vector<double> v)
{
    std::sort(v.begin(), v.end());
    return v[v.size() / 2];
}

typedef enum { CGAL_SERIAL, CGAL_PARALLEL, OURS_ONE_THREAD, OURS_ANY_ORDER } rival_kind;

static void compare(const char *name, const std::vector<double> &xyz, int threads, rival_kind rival,
                    int runs)
{
    static const char *const names[] = {"cgal", "cgal_par", "ours_1t", "ours_any_order"};
    std::vector<double> ours, theirs;
    size_t peak = 0, unused;
    for (int r = 0; r < runs; r++) {
        ours.push_back(run_ours(xyz, threads, 0, &peak));
        if (rival == OURS_ONE_THREAD) theirs.push_back(run_ours(xyz, 1, 0, &unused));
        if (rival == OURS_ANY_ORDER) theirs.push_back(run_ours(xyz, threads, 1, &unused));
#ifdef WITH_CGAL
        if (rival == CGAL_SERIAL) theirs.push_back(run_cgal(xyz, 1));
        if (rival == CGAL_PARALLEL) theirs.push_back(run_cgal(xyz, threads));
#endif
    }
    if (theirs.empty()) theirs.push_back(NAN);
    printf("delaunay,%s,%d,%.4f,%s,%.4f,%.2f\n", name, threads, median(ours), names[rival],
           median(theirs), median(theirs) / median(ours));
    if (rival == CGAL_SERIAL || rival == CGAL_PARALLEL)
        fprintf(stderr, "%s: %.0f bytes a point by our own account\n", name,
                (double)peak / ((double)xyz.size() / 3));
    fflush(stdout);
}

/* How the time falls with the threads. One thread is timed by the clock here, as the others are. */
static void scale(const char *list, size_t n, int runs)
{
    const std::vector<double> xyz = make_points("uniform", n);
    double one_thread = NAN;
    char *end;
    for (long threads; (threads = strtol(list, &end, 10)) > 0; list = end) {
        std::vector<double> ours;
        delaunay_report phases;
        size_t unused;
        double rival = NAN;
        for (int r = 0; r < runs; r++) {
            run_ours(xyz, (int)threads, 0, &unused, &phases);
            ours.push_back(phases.seconds_sort + phases.seconds_insert + phases.seconds_finish);
        }
        if (threads == 1) one_thread = median(ours);
        printf("delaunay,uniform-%lu,%ld,%.4f,ours_1t,%.4f,%.2f\n", (unsigned long)n, threads,
               median(ours), one_thread, one_thread / median(ours));
#ifdef WITH_CGAL
        if (threads > 1) rival = run_cgal(xyz, (int)threads);
#endif
        if (threads > 1)
            printf("delaunay,uniform-%lu,%ld,%.4f,cgal_par,%.4f,%.2f\n", (unsigned long)n, threads,
                   median(ours), rival, rival / median(ours));
        fprintf(stderr, "%ld threads: sort %.3f, insert %.3f, number %.3f s\n", threads,
                phases.seconds_sort, phases.seconds_insert, phases.seconds_finish);
        fflush(stdout);
    }
}

/* What is freed stays with the process, so that from the second run on everybody gets memory that
 * was touched: else the system's clearing of fresh pages is timed, which varies tenfold on virtual
 * machines. */
static void keep_memory()
{
#ifdef __GLIBC__
    mallopt(M_MMAP_MAX, 0);
    mallopt(M_TRIM_THRESHOLD, -1);
#endif
}

int main()
{
    int quick = getenv("QUICK") && atoi(getenv("QUICK"));
    size_t large = quick ? 100000 : 1000000;
    int runs = quick ? 3 : 5;
#ifndef WITH_CGAL
    fprintf(stderr, "bench_delaunay: built without CGAL (apt-get install libcgal-dev libtbb-dev): "
                    "no rival's times\n");
#endif
    printf("bench,case,threads,ours_s,rival,rival_s,ratio\n");
    if (getenv("THREADS")) {
        keep_memory();
        scale(getenv("THREADS"), getenv("POINTS") ? (size_t)atof(getenv("POINTS")) : 10000000,
              getenv("RUNS") ? atoi(getenv("RUNS")) : 3);
        return 0;
    }
    std::vector<double> p = make_points("uniform", large);
    size_t unused;
    double before = peak_of_process();
    run_ours(p, 1, 0, &unused);
    fprintf(stderr, "%s: the process grew by %.0f bytes a point over the input\n",
            quick ? "uniform-1e5" : "uniform-1e6", (peak_of_process() - before) / (double)large);
    keep_memory();
    run_ours(p, 1, 0, &unused);
    compare(quick ? "uniform-1e5" : "uniform-1e6", p, 1, CGAL_SERIAL, runs);
    compare(quick ? "uniform-1e5" : "uniform-1e6", p, 2, OURS_ONE_THREAD, runs);
    compare(quick ? "uniform-1e5" : "uniform-1e6", p, 2, CGAL_PARALLEL, runs);
    compare(quick ? "uniform-1e5" : "uniform-1e6", p, 2, OURS_ANY_ORDER, runs);
    if (!quick) compare("uniform-1e5", make_points("uniform", 100000), 1, CGAL_SERIAL, runs);
    compare(quick ? "clusters-1e5" : "clusters-1e6", make_points("clusters", large), 1, CGAL_SERIAL,
            runs);
    compare("sphere-1e5", make_points("sphere", 100000), 1, CGAL_SERIAL, runs);
    if (!quick) compare("sphere-1e6", make_points("sphere", large), 1, CGAL_SERIAL, 3);
    compare(quick ? "grid-46" : "grid-100", make_points("grid", quick ? 97336 : large), 1,
            CGAL_SERIAL, runs);
    compare("grid-decimal", make_points("grid-decimal", quick ? 97336 : large), 1, CGAL_SERIAL,
            quick ? runs : 3);
    compare("lines-2x2000", make_points("lines", 4000), 1, CGAL_SERIAL, 3);
    return 0;
}
