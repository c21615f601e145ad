/* Preloaded: makes the n-th of some calls to the system fail. tests/faults/calls.py builds and steers
   it. Calls count where their file lies below a folder, and allocations where they are large. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum { NOTHING, WRITING, READING, MEMORY, KINDS };

/* What is to fail, and what has; shared with the processes forked from this one. */
struct plan {
    long kind;      /* of the call that fails; NOTHING: calls do not even count */
    long number;    /* of that call, from 1; 0: none */
    long error;     /* errno */
    long lasting;   /* whether all later calls fail as well */
    long large;     /* bytes from which an allocation counts */
    long counts[KINDS]; /* calls of each kind so far */
    long failed;    /* calls that failed */
    char call[32];  /* the first that failed */
    char folder[PATH_MAX];
};

static struct plan *plan;

__attribute__((constructor)) static void begin(void)
{
    void *made = (void *)syscall(SYS_mmap, NULL, sizeof *plan, PROT_READ | PROT_WRITE,
                                 MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (made != MAP_FAILED)
        plan = made;
}

struct plan *faults_plan(void) { return plan; }

/* Whether this call fails; errno is set then. `first` tells the one that fails first. */
static int fails(int kind, const char *call, int *first)
{
    if (first)
        *first = 0;
    if (plan->lasting && strstr(call, "truncate")) /* which needs no room */
        return 0;
    long number = __atomic_add_fetch(&plan->counts[kind], 1, __ATOMIC_SEQ_CST);
    if (plan->kind != kind || !plan->number || number < plan->number || (number > plan->number && !plan->lasting))
        return 0;
    if (number == plan->number) {
        strncpy(plan->call, call, sizeof plan->call - 1);
        if (first)
            *first = 1;
    }
    __atomic_add_fetch(&plan->failed, 1, __ATOMIC_SEQ_CST);
    errno = (int)plan->error;
    return 1;
}

static int active(void) { return plan && plan->kind; }

static int within(const char *path)
{
    size_t length = strlen(plan->folder);
    return !strncmp(path, plan->folder, length) && (path[length] == '/' || !path[length]);
}

static int of_file(int file)
{
    char link[64], path[PATH_MAX];
    int before = errno;
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    ssize_t length = readlink(link, path, sizeof path - 1);
    errno = before;
    if (length < 0)
        return 0;
    path[length] = 0;
    return within(path);
}

static int of_path(int folder, const char *path)
{
    char here[PATH_MAX];
    if (!path)
        return 0;
    if (path[0] == '/')
        return within(path);
    if (folder != AT_FDCWD)
        return of_file(folder);
    return getcwd(here, sizeof here) && within(here);
}

#define REAL(result, name, ...)                                                                    \
    static result (*real)(__VA_ARGS__);                                                            \
    if (!real)                                                                                     \
        real = (result(*)(__VA_ARGS__))dlsym(RTLD_NEXT, #name)

/* A call on a file that is open, or on a path. */
#define ON_FILE(kind, result, name, parameters, arguments, file)                                   \
    result name parameters                                                                         \
    {                                                                                              \
        static result(*real) parameters;                                                           \
        if (!real)                                                                                 \
            real = (result(*) parameters)dlsym(RTLD_NEXT, #name);                                  \
        if (active() && of_file(file) && fails(kind, #name, NULL))                             \
            return -1;                                                                             \
        return real arguments;                                                                     \
    }
#define ON_PATH(name, parameters, arguments, folder, path)                                         \
    int name parameters                                                                            \
    {                                                                                              \
        static int(*real) parameters;                                                              \
        if (!real)                                                                                 \
            real = (int(*) parameters)dlsym(RTLD_NEXT, #name);                                     \
        if (active() && of_path(folder, path) && fails(WRITING, #name, NULL))               \
            return -1;                                                                             \
        return real arguments;                                                                     \
    }

/* Opening. */

static int opening(int folder, const char *path, int flags)
{
    int kind = flags & (O_WRONLY | O_RDWR | O_CREAT | O_TRUNC) ? WRITING : READING;
    return active() && of_path(folder, path) && fails(kind, "open", NULL);
}

#define MODE(flags)                                                                                \
    mode_t mode = 0;                                                                               \
    if ((flags) & (O_CREAT | __O_TMPFILE)) {                                                       \
        va_list more;                                                                              \
        va_start(more, flags);                                                                     \
        mode = va_arg(more, mode_t);                                                               \
        va_end(more);                                                                              \
    }
#define OPEN(name)                                                                                 \
    int name(const char *path, int flags, ...)                                                     \
    {                                                                                              \
        REAL(int, name, const char *, int, ...);                                                   \
        MODE(flags)                                                                                \
        return opening(AT_FDCWD, path, flags) ? -1 : real(path, flags, mode);                      \
    }
#define OPENAT(name)                                                                               \
    int name(int folder, const char *path, int flags, ...)                                         \
    {                                                                                              \
        REAL(int, name, int, const char *, int, ...);                                              \
        MODE(flags)                                                                                \
        return opening(folder, path, flags) ? -1 : real(folder, path, flags, mode);                \
    }
#define FOPEN(name)                                                                                \
    FILE *name(const char *path, const char *mode)                                                 \
    {                                                                                              \
        REAL(FILE *, name, const char *, const char *);                                            \
        int flags = mode[0] == 'r' && !strchr(mode, '+') ? O_RDONLY : O_RDWR;                      \
        return opening(AT_FDCWD, path, flags) ? NULL : real(path, mode);                           \
    }

OPEN(open)
OPEN(open64)
OPENAT(openat)
OPENAT(openat64)
FOPEN(fopen)
FOPEN(fopen64)

int __open_2(const char *path, int flags) { return open(path, flags); }
int __open64_2(const char *path, int flags) { return open64(path, flags); }
int __openat_2(int folder, const char *path, int flags) { return openat(folder, path, flags); }
int __openat64_2(int folder, const char *path, int flags) { return openat64(folder, path, flags); }
int creat(const char *path, mode_t mode) { return open(path, O_CREAT | O_WRONLY | O_TRUNC, mode); }
int creat64(const char *path, mode_t mode)
{
    return open64(path, O_CREAT | O_WRONLY | O_TRUNC, mode);
}

/* Writing. A disk that fills up takes a part of the bytes first. */

ssize_t write(int file, const void *bytes, size_t size)
{
    REAL(ssize_t, write, int, const void *, size_t);
    int first;
    if (!active() || !of_file(file) || !fails(WRITING, "write", &first))
        return real(file, bytes, size);
    if (first && plan->lasting && size > 1)
        return real(file, bytes, size / 2);
    return -1;
}

ON_FILE(WRITING, ssize_t, pwrite, (int f, const void *b, size_t n, off_t o), (f, b, n, o), f)
ON_FILE(WRITING, ssize_t, pwrite64, (int f, const void *b, size_t n, off64_t o), (f, b, n, o), f)
ON_FILE(WRITING, ssize_t, writev, (int f, const struct iovec *v, int n), (f, v, n), f)
ON_FILE(WRITING, ssize_t, pwritev, (int f, const struct iovec *v, int n, off_t o), (f, v, n, o), f)
ON_FILE(WRITING, int, fsync, (int f), (f), f)
ON_FILE(WRITING, int, fdatasync, (int f), (f), f)
ON_FILE(WRITING, int, ftruncate, (int f, off_t n), (f, n), f)
ON_FILE(WRITING, int, ftruncate64, (int f, off64_t n), (f, n), f)
ON_FILE(WRITING, int, fallocate, (int f, int m, off_t o, off_t n), (f, m, o, n), f)
ON_FILE(WRITING, int, posix_fallocate, (int f, off_t o, off_t n), (f, o, n), f)
ON_FILE(WRITING, ssize_t, sendfile, (int f, int g, off_t *o, size_t n), (f, g, o, n), f)
ON_FILE(WRITING, ssize_t, sendfile64, (int f, int g, off64_t *o, size_t n), (f, g, o, n), f)
ON_FILE(WRITING, ssize_t, copy_file_range,
        (int g, off64_t *p, int f, off64_t *o, size_t n, unsigned m), (g, p, f, o, n, m), f)
ON_FILE(WRITING, int, fchmod, (int f, mode_t m), (f, m), f)

ON_PATH(truncate, (const char *p, off_t n), (p, n), AT_FDCWD, p)
ON_PATH(truncate64, (const char *p, off64_t n), (p, n), AT_FDCWD, p)
ON_PATH(rename, (const char *p, const char *q), (p, q), AT_FDCWD, q)
ON_PATH(renameat, (int f, const char *p, int g, const char *q), (f, p, g, q), g, q)
ON_PATH(renameat2, (int f, const char *p, int g, const char *q, unsigned m), (f, p, g, q, m), g, q)
ON_PATH(link, (const char *p, const char *q), (p, q), AT_FDCWD, q)
ON_PATH(symlink, (const char *p, const char *q), (p, q), AT_FDCWD, q)
ON_PATH(mkdir, (const char *p, mode_t m), (p, m), AT_FDCWD, p)
ON_PATH(mkdirat, (int f, const char *p, mode_t m), (f, p, m), f, p)
ON_PATH(chmod, (const char *p, mode_t m), (p, m), AT_FDCWD, p)
ON_PATH(fchmodat, (int f, const char *p, mode_t m, int o), (f, p, m, o), f, p)

/* The file is closed all the same, as Linux does it. */
int close(int file)
{
    REAL(int, close, int);
    int ours = active() && of_file(file) &&
               (fcntl(file, F_GETFL) & O_ACCMODE) != O_RDONLY;
    int failed = ours && fails(WRITING, "close", NULL);
    int result = real(file);
    if (failed)
        errno = (int)plan->error;
    return failed ? -1 : result;
}

/* Reading. */

ON_FILE(READING, ssize_t, read, (int f, void *b, size_t n), (f, b, n), f)
ON_FILE(READING, ssize_t, pread, (int f, void *b, size_t n, off_t o), (f, b, n, o), f)
ON_FILE(READING, ssize_t, pread64, (int f, void *b, size_t n, off64_t o), (f, b, n, o), f)
ON_FILE(READING, ssize_t, readv, (int f, const struct iovec *v, int n), (f, v, n), f)

/* Memory. */

extern void *__libc_malloc(size_t), *__libc_calloc(size_t, size_t), *__libc_realloc(void *, size_t);
extern void *__libc_memalign(size_t, size_t);

static int short_of(size_t size, const char *call)
{
    return active() && size >= (size_t)plan->large && fails(MEMORY, call, NULL);
}

void *malloc(size_t size) { return short_of(size, "malloc") ? NULL : __libc_malloc(size); }

void *calloc(size_t count, size_t size)
{
    int much = count && size > SIZE_MAX / count;
    return !much && short_of(count * size, "calloc") ? NULL : __libc_calloc(count, size);
}

void *realloc(void *old, size_t size)
{
    return short_of(size, "realloc") ? NULL : __libc_realloc(old, size);
}

void *memalign(size_t step, size_t size)
{
    return short_of(size, "memalign") ? NULL : __libc_memalign(step, size);
}

void *aligned_alloc(size_t step, size_t size) { return memalign(step, size); }

int posix_memalign(void **made, size_t step, size_t size)
{
    void *found = memalign(step, size);
    if (found)
        *made = found;
    return found ? 0 : ENOMEM;
}

static void *mapped(void *at, size_t size, int access, int flags, int file, off_t from)
{
    int writes = file >= 0 && flags & MAP_SHARED && access & PROT_WRITE;
    if (file < 0 && short_of(size, "mmap"))
        return MAP_FAILED;
    if (writes && active() && of_file(file) && fails(WRITING, "mmap", NULL))
        return MAP_FAILED;
    if (file >= 0 && !writes && active() && of_file(file) && fails(READING, "mmap", NULL))
        return MAP_FAILED;
    return (void *)syscall(SYS_mmap, at, size, access, flags, file, from);
}

void *mmap(void *at, size_t size, int access, int flags, int file, off_t from)
{
    return mapped(at, size, access, flags, file, from);
}

void *mmap64(void *at, size_t size, int access, int flags, int file, off64_t from)
{
    return mapped(at, size, access, flags, file, from);
}
