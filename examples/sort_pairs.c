/* sort_pairs.c - sorts (key, value) pairs, and records by one of their fields.
 *
 *   cc -O3 -fopenmp examples/sort_pairs.c -o sort_pairs -lm && ./sort_pairs [COUNT]
 *
 * Needs hxtsort.h only.
 */
#define HXTSORT_IMPLEMENTATION
#include "../hxtsort.h"
#include <stdio.h>
#ifdef _OPENMP
#include <omp.h>
#endif
#include <time.h>

typedef struct city {
    const char *name;
    float       height; /* metres above the sea */
} city;
#define HXTSORT_NAME   sort_by_height
#define HXTSORT_TYPE   city
#define HXTSORT_KEY(c) ((c).height)
#define HXTSORT_BITS   hxtsort_bits_f32
#include "../hxtsort.h"

static double seconds(void)
{
#ifdef _OPENMP
    return omp_get_wtime();
#else
    return (double)clock() / CLOCKS_PER_SEC; /* CPU time: with one thread, about the same */
#endif
}

/* The whole number from 1 on that a text stands for, such as 1000 or 1e6; 0 if it is none, or so
 * large that this many pairs do not fit in memory. */
static size_t number(const char *text)
{
    char *end;
    double value = strtod(text, &end);
    return *text && !*end && value >= 1 && value < (double)(SIZE_MAX / 64) ? (size_t)value : 0;
}

int main(int argc, char **argv)
{
    city cities[4] = {{"La Paz", 3640}, {"Baku", -28}, {"Louvain", 35}, {"Quito", 2850}};
    size_t count = argc > 1 ? number(argv[1]) : 10000000;

    if (sort_by_height(cities, 4, NULL) != HXTSORT_OK) return 7;
    for (int i = 0; i < 4; i++) printf("%-8s %5.0f m\n", cities[i].name, (double)cities[i].height);

    if (count == 0) {
        fprintf(stderr, "usage: sort_pairs [COUNT]\n");
        return 2;
    }
    hxtsort_pair *pairs = (hxtsort_pair *)malloc(count * sizeof *pairs);
    if (!pairs) {
        fprintf(stderr, "sort_pairs: out of memory\n");
        return 7;
    }
    uint64_t random = 1;
    for (size_t i = 0; i < count; i++) {
        random = random * 6364136223846793005u + 1442695040888963407u;
        pairs[i].key = random ^ random >> 29;
        pairs[i].value = i;
    }
    double start = seconds();
    hxtsort_result result = hxtsort_pairs(pairs, count, NULL);
    double took = seconds() - start;
    if (result != HXTSORT_OK) {
        fprintf(stderr, "sort_pairs: %s\n", hxtsort_result_string(result));
        return 7;
    }
    for (size_t i = 1; i < count; i++)
        if (pairs[i - 1].key > pairs[i].key) return 70;
    printf("%lu pairs in %.3f s\n", (unsigned long)count, took);
    free(pairs);
    return 0;
}
