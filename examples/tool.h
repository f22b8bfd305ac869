/* tool.h - include after delaunay.h: what the command line tools of this folder share: exit codes,
 * arguments, clock, memory */
#ifndef TOOL_H
#define TOOL_H

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifndef __wasi__ /* has no signals */
#  include <signal.h>
#endif
#if (defined(__unix__) || defined(__APPLE__)) && \
    (!defined(__STRICT_ANSI__) || defined(_XOPEN_SOURCE))
#  include <sys/resource.h>
#  include <sys/stat.h>
#  include <sys/time.h>
#  include <unistd.h>
#  define TOOL_POSIX 1
#endif

/* The README has this table. */
enum {
    TOOL_OK = 0,
    TOOL_GOAL_NOT_MET =
        1, /* a valid result, but a goal or budget that the user asked for was not met */
    TOOL_USAGE = 2,
    TOOL_CANNOT_READ = 3,
    TOOL_CANNOT_WRITE = 4,
    TOOL_BAD_SURFACE = 5, /* delaunay: points of fewer than three dimensions, or not finite */
    TOOL_NOT_RECOVERED = 6,
    TOOL_NO_MEMORY = 7,
    TOOL_STOPPED = 8, /* cancelled before there was a valid result */
    TOOL_INTERNAL = 70
};

/* Set by the first interrupt; the second one ends the program as usual. */
#ifdef __wasi__
static volatile int tool_interrupted;

DELAUNAY_INLINE void tool_catch_signals(void) {}
#else
static volatile sig_atomic_t tool_interrupted;

DELAUNAY_INLINE void tool_on_interrupt(int number)
{
    tool_interrupted = 1;
    signal(number, SIG_DFL);
}

/* The first interrupt is noted; a file that becomes too large is an error of writing, not the end.
 */
DELAUNAY_INLINE void tool_catch_signals(void)
{
    signal(SIGINT, tool_on_interrupt);
#  ifdef SIGXFSZ
    signal(SIGXFSZ, SIG_IGN);
#  endif
}
#endif

/* A progress callback that cancels after an interrupt. */
DELAUNAY_INLINE int tool_progress(void *user, const char *phase, double fraction)
{
    (void)user, (void)phase, (void)fraction;
    return tool_interrupted;
}

/* The name of a file to write; "-" is where the program prints. */
DELAUNAY_INLINE const char *tool_output_name(const char *text)
{
#ifdef TOOL_POSIX
    if (text && strcmp(text, "-") == 0) return "/dev/stdout";
#endif
    return text;
}

/* A decimal number that fills the whole argument and lies in [low, high]; 0 if it does not. */
DELAUNAY_INLINE int tool_number(const char *text, double low, double high, double *value)
{
    char *end;
    if (!text || strspn(text, "0123456789.eE+-") != strlen(text) || *text == '-') return 0;
    errno = 0;
    *value = strtod(text, &end);
    return *end == 0 && end != text && *value >= low && *value <= high;
}

/* An option and what has to follow it, in words; if it is a number, this is from low to high. */
typedef struct tool_need {
    const char *option, *value;
    double      low, high; /* 0, 0: no number */
} tool_need;

/* The number that follows an option; 0 if it is to be no number, or is not in the option's range.
 * needs: the options with a value, up to a NULL. */
DELAUNAY_INLINE int tool_needed_number(const tool_need *needs, const char *option,
                                       const char *next, double *value)
{
    while (needs->option && strcmp(needs->option, option) != 0) needs++;
    return needs->high > 0 && tool_number(next, needs->low, needs->high, value);
}

/* Says why an argument was not understood. next: the argument that follows, or NULL. */
DELAUNAY_INLINE void tool_complain(const char *tool, const tool_need *needs, const char *argument,
                                   const char *next)
{
    for (; needs->option; needs++)
        if (strcmp(needs->option, argument) == 0) {
            fprintf(stderr, "%s: %s needs %s%s%s%s; try --help\n", tool, argument, needs->value,
                    next ? ", not '" : "", next ? next : "", next ? "'" : "");
            return;
        }
    fprintf(stderr, "%s: %s'%s'%s; try --help\n", tool,
            argument[0] == '-' ? "there is no option " : "", argument,
            argument[0] == '-' ? "" : " is one file too many");
}

/* Seconds on a wall clock where there is one; differences count. */
DELAUNAY_INLINE double tool_seconds(void)
{
#ifdef TOOL_POSIX
    struct timeval now;
    gettimeofday(&now, NULL);
    return (double)now.tv_sec + 1e-6 * (double)now.tv_usec;
#else
    delaunay_host host;
    memset(&host, 0, sizeof host);
    return delaunay_seconds(&host);
#endif
}

/* Largest memory of the process so far in bytes, 0 if unknown. */
DELAUNAY_INLINE double tool_peak_bytes(void)
{
#ifdef TOOL_POSIX
    struct rusage usage;
    if (getrusage(RUSAGE_SELF, &usage) != 0) return 0;
#  ifdef __APPLE__
    return (double)usage.ru_maxrss;
#  else
    return 1024.0 * (double)usage.ru_maxrss;
#  endif
#else
    return 0;
#endif
}

DELAUNAY_INLINE int tool_is_terminal(FILE *file)
{
#ifdef TOOL_POSIX
    return isatty(fileno(file));
#else
    (void)file;
    return 0;
#endif
}

#ifdef TOOL_POSIX
/* Whether two paths end in the same name, in the same folder: the files need not exist. */
DELAUNAY_INLINE int tool_same_place(const char *a, const char *b)
{
    const char *path[2];
    struct stat folder[2];
    int k;
    path[0] = a;
    path[1] = b;
    for (k = 0; k < 2; k++) {
        const char *slash = strrchr(path[k], '/');
        char name[1025];
        size_t n = slash ? (size_t)(slash - path[k]) + 1 : 0;
        if (n >= sizeof name) return 0;
        memcpy(name, path[k], n);
        strcpy(name + n, n ? "" : ".");
        if (stat(name, &folder[k]) != 0) return 0;
        path[k] += n;
    }
    return strcmp(path[0], path[1]) == 0 && folder[0].st_dev == folder[1].st_dev &&
           folder[0].st_ino == folder[1].st_ino;
}
#endif

/* Whether two names, either may be NULL, are those of one file. */
DELAUNAY_INLINE int tool_same_file(const char *a, const char *b)
{
    if (!a || !b) return 0;
#ifdef TOOL_POSIX
    {
        struct stat of_a, of_b; /* devices may be shared: nothing there is lost */
        if (stat(a, &of_a) == 0 && stat(b, &of_b) == 0)
            return of_a.st_dev == of_b.st_dev && of_a.st_ino == of_b.st_ino &&
                   S_ISREG(of_a.st_mode);
        return strcmp(a, b) == 0 || tool_same_place(a, b);
    }
#else
    return strcmp(a, b) == 0;
#endif
}

/* 0, and a sentence, if the file that an option names is another one's, too. */
DELAUNAY_INLINE int tool_is_apart(const char *tool, const char *option, const char *name,
                                  const char *other)
{
    if (!tool_same_file(name, other)) return 1;
    fprintf(stderr, "%s: %s would be written over '%s'; try --help\n", tool, option, other);
    return 0;
}

enum { TOOL_MAX_NAME = 1024 };

/* A path with another ending. Returns 0 if it is too long. */
DELAUNAY_INLINE int tool_with_ending(const char *path, const char *ending,
                                     char name[TOOL_MAX_NAME])
{
    const char *slash = strrchr(path, '/'), *dot = strrchr(path, '.');
    size_t stem = dot && (!slash || dot > slash) ? (size_t)(dot - path) : strlen(path);
    if (stem + strlen(ending) >= TOOL_MAX_NAME) return 0;
    memcpy(name, path, stem);
    strcpy(name + stem, ending);
    return 1;
}

/* 0, and a sentence, if the compiler's flags or the processor's mode break exact arithmetic. */
DELAUNAY_INLINE int tool_is_exact(const char *tool)
{
    if (delaunay_selftest() != DELAUNAY_ERROR_BROKEN_ARITHMETIC) return 1;
    fprintf(stderr,
            "%s: internal error: the flags that this program was compiled with, or the mode of the "
            "processor, break exact arithmetic\n", tool);
    return 0;
}

/* Whether a name ends in one of two endings of four characters. */
DELAUNAY_INLINE int tool_ends_in(const char *name, const char *ending, const char *other)
{
    size_t n = name ? strlen(name) : 0;
    return n > 4 && (strcmp(name + n - 4, ending) == 0 || strcmp(name + n - 4, other) == 0);
}

/* 0, and a sentence, if the file that an option names is one of the input, or one that is there and
 * may be read with it: nodes and facets beside cells, sizes beside a mesh. */
DELAUNAY_INLINE int tool_spares(const char *tool, const char *option, const char *name,
                                const char *input)
{
    static const char *const endings[4] = {".node", ".face", ".sol", ".mtr"};
    char beside[TOOL_MAX_NAME];
    int k;
    if (!name || !input) return 1;
    for (k = 0; k < 4; k++) {
        FILE *f = tool_with_ending(input, endings[k], beside) ? fopen(beside, "rb") : NULL;
        if (!f) continue;
        fclose(f);
        if (!tool_is_apart(tool, option, name, beside)) return 0;
    }
    return tool_is_apart(tool, option, name, input);
}

/* 0, and a sentence, if the file that an option names is the output, or beside it: an .ele file is
 * written with nodes and facets. */
DELAUNAY_INLINE int tool_clears_output(const char *tool, const char *option, const char *name,
                                       const char *output, int is_ele)
{
    static const char *const endings[2] = {".node", ".face"};
    char beside[TOOL_MAX_NAME];
    int k;
    if (!name || !output) return 1;
    for (k = 0; k < 2 && is_ele; k++)
        if (tool_with_ending(output, endings[k], beside) &&
            !tool_is_apart(tool, option, name, beside))
            return 0;
    return tool_is_apart(tool, option, name, output);
}

/* 0, and a sentence, if the nodes beside the .ele file that an option names would replace those
 * that are, or are beside, the input. */
DELAUNAY_INLINE int tool_spares_nodes(const char *tool, const char *option, const char *output,
                                      const char *input)
{
    char nodes[TOOL_MAX_NAME], written[TOOL_MAX_NAME], what[64];
    FILE *f;
    if (!output || !input) return 1;
    if (!tool_with_ending(input, ".node", nodes) || !tool_with_ending(output, ".node", written)) {
        fprintf(stderr, "%s: a name is longer than %d characters\n", tool, TOOL_MAX_NAME);
        return 0;
    }
    f = fopen(nodes, "rb");
    if (!f) return 1;
    fclose(f);
    snprintf(what, sizeof what, "the .node file of %s", option);
    return tool_is_apart(tool, what, written, nodes);
}

/* Whether a name stands for where the program prints: then it prints nothing but what goes
 * there. */
DELAUNAY_INLINE int tool_is_stdout(const char *name)
{
#ifdef TOOL_POSIX
    struct stat of_name, of_stdout;
    return name && stat(name, &of_name) == 0 && fstat(STDOUT_FILENO, &of_stdout) == 0 &&
           of_name.st_dev == of_stdout.st_dev && of_name.st_ino == of_stdout.st_ino;
#else
    (void)name;
    return 0;
#endif
}

/* Sorts the corners of a triangle ascending. Returns whether that turns it over. */
DELAUNAY_INLINE int tool_ascend(uint32_t v[3])
{
    int i, k, odd = 0;
    for (i = 0; i < 2; i++)
        for (k = 0; k < 2 - i; k++)
            if (v[k] > v[k + 1]) {
                uint32_t swap = v[k];
                v[k] = v[k + 1];
                v[k + 1] = swap;
                odd = !odd;
            }
    return odd;
}

/* Renumbers n corners of elements. */
DELAUNAY_INLINE void tool_renumber(uint32_t *v, uint64_t n, const uint32_t *number)
{
    uint64_t i;
    for (i = 0; i < n; i++) v[i] = number[v[i]];
}

/* A number that no tag is: the next one above all tags and 0 if there is one. */
DELAUNAY_INLINE int32_t tool_unused_tag(const int32_t *tags, size_t count)
{
    int32_t tag = 0;
    size_t i;
    for (i = 0; i < count; i++)
        if (tags[i] > tag) tag = tags[i];
    if (tag < INT32_MAX) return tag + 1;
    for (i = 0; i < count; i++)
        if (tags[i] == tag) {
            tag--;
            i = (size_t)-1; /* from the first one again */
        }
    return tag;
}

/* Whether a mesh can be written to a name, NULL: none, so that nobody waits for one in vain; if
 * not, says why. As meshio_write, by a file beside it that is renamed. */
DELAUNAY_INLINE int tool_can_create(const char *tool, const char *path)
{
    char part[1100];
    FILE *f;
#ifdef TOOL_POSIX
    struct stat is;
    if (path && stat(path, &is) == 0 && S_ISDIR(is.st_mode)) {
        fprintf(stderr, "%s: cannot write '%s': it is a folder\n", tool, path);
        return 0;
    }
#endif
    if (!path || strncmp(path, "/dev/", 5) == 0) return 1;
    snprintf(part, sizeof part, "%.1024s.part", path);
    f = fopen(part, "wb");
    if (!f) {
        fprintf(stderr, "%s: cannot create '%s': %s\n", tool, part, strerror(errno));
        return 0;
    }
    fclose(f);
    remove(part);
    return 1;
}

/* The number of bytes of the UTF-8 character at the start of a text; 0 if there is no valid one. */
DELAUNAY_INLINE int tool_utf8_length(const unsigned char *c)
{
    int n = c[0] < 128 ? 1 : c[0] >= 0xC2 && c[0] < 0xE0 ? 2 : c[0] >= 0xE0 && c[0] < 0xF0 ? 3
                         : c[0] >= 0xF0 && c[0] < 0xF5   ? 4
                                                         : 0,
        i;
    for (i = 1; i < n; i++)
        if ((c[i] & 0xC0) != 0x80) return 0;
    if (n == 3 && ((c[0] == 0xE0 && c[1] < 0xA0) || (c[0] == 0xED && c[1] > 0x9F))) return 0;
    return n == 4 && ((c[0] == 0xF0 && c[1] < 0x90) || (c[0] == 0xF4 && c[1] > 0x8F)) ? 0 : n;
}

/* Writes the inside of a JSON string. File names may have any bytes: what is not UTF-8 becomes
 * U+FFFD. */
DELAUNAY_INLINE void tool_json_text(FILE *f, const char *text)
{
    const unsigned char *c = (const unsigned char *)text;
    while (*c) {
        int n = tool_utf8_length(c);
        if (*c == '"' || *c == '\\') fprintf(f, "\\%c", *c);
        else if (*c < 32) fprintf(f, "\\u%04x", *c);
        else if (n == 0) fputs("\\ufffd", f);
        else fwrite(c, 1, (size_t)n, f);
        c += n ? n : 1;
    }
}

/* Writes "name": value, then what follows; null for a value that is not finite, which JSON has
 * none for. */
DELAUNAY_INLINE void tool_json_value(FILE *f, const char *name, double value, const char *after)
{
    if (value - value == 0) fprintf(f, "\"%s\": %.9g%s", name, value, after);
    else fprintf(f, "\"%s\": null%s", name, after);
}

/* Writes an array of counts as a member of a JSON object. */
DELAUNAY_INLINE void tool_json_counts(FILE *f, const char *name, const uint64_t *count, int n)
{
    int i;
    fprintf(f, "\"%s\": [", name);
    for (i = 0; i < n; i++) fprintf(f, "%s%llu", i ? ", " : "", (unsigned long long)count[i]);
    fprintf(f, "]");
}

/* The exit code, when all is printed. */
DELAUNAY_INLINE int tool_end(const char *tool, int code)
{
    if (fflush(stdout) == 0 && !ferror(stdout)) return code;
    fprintf(stderr, "%s: cannot write to the standard output\n", tool);
    return code == TOOL_OK || code == TOOL_GOAL_NOT_MET ? TOOL_CANNOT_WRITE : code;
}

#endif /* TOOL_H */
