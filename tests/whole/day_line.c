// SPDX-License-Identifier: Apache-2.0
// Serial lines, Modbus TCP and opentrack's datagrams: drivers and libmodbus are
// the real ones on real sockets. Only what waits is answered here: while a
// driver waits, its instrument acts and the lane's time passes. A serial line
// is a pair of sockets, since what goes through a terminal arrives some time
// later, by a clock that is not ours.
#include <arpa/inet.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <termios.h>
#include <unistd.h>

#include "base/clock.h"
#include "simulator/wire_inclinometer.h"
#include "simulator/wire_radiometer.h"
#include "tests/whole/day.h"

enum { DEAD_MOST = 64, ARRIVAL_MS = 20000 }; // of bytes that are under way; bounds a hang only

// The instrument's side of one line.
struct line {
    struct lane *lane;
    struct line_end end;
    struct inclinometer *inclinometer;
    struct radiometer_end *radiometer;
    int far, near; // -1 = nobody has it open
    bool busy;     // the instrument has its request and works on it
};

static struct line rtu = {.far = -1, .near = -1}, radiometer = {.far = -1, .near = -1};

static struct {
    struct line line; // far: the connection that is served
    int listener, keeper, port, dead[DEAD_MOST], dead_count;
    int asked, heard; // requests sent by the driver; those that arrived
    bool answered;    // an answer is under way
    char path[32];
} tcp = {.line = {.far = -1, .near = -1}, .listener = -1, .keeper = -1};

static void shut(int *fd)
{
    if (*fd >= 0)
        close(*fd);
    *fd = -1;
}

static bool is_ready(int fd, short events, int real_ms)
{
    struct pollfd p = {.fd = fd, .events = events};
    struct timespec most = {real_ms / 1000, real_ms % 1000 * 1000000L};
    return syscall(SYS_ppoll, &p, 1, &most, NULL, 0) > 0;
}

static bool has_hung_up(int fd)
{
    char byte;
    ssize_t count = recv(fd, &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    return count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR);
}

static enum wire_fault fault_of(const struct lane *lane)
{
    return lane->fault < DAY_BUSY ? (enum wire_fault)lane->fault : WIRE_FINE;
}

// ---- serial lines --------------------------------------------------------------

static int64_t serve(struct line *l)
{
    if (l->far < 0)
        return INT64_MAX;
    bool readable = is_ready(l->far, POLLIN, 0);
    if (readable && has_hung_up(l->far)) {
        shut(&l->far);
        return INT64_MAX;
    }
    return l->end.serve(l->end.context, l->far, readable, fault_of(l->lane));
}

static int64_t serve_rtu(int fd)
{
    (void)fd;
    return serve(&rtu);
}

static int64_t serve_radiometer(int fd)
{
    (void)fd;
    return serve(&radiometer);
}

static void hang_up(struct line *l, int fault)
{
    if (fault == WIRE_UNPLUGGED || fault == WIRE_FORBIDDEN || fault == DAY_BUSY)
        shut(&l->far);
}

static void strike_rtu(int fault)
{
    hang_up(&rtu, fault);
}

static void strike_radiometer(int fault)
{
    hang_up(&radiometer, fault);
}

static struct wire_options options_of(const struct around *around, bool over_tcp)
{
    return (struct wire_options){
        .around = *around,
        .serial = {[WIRE_INCLINOMETER] = "EMUWT901", [WIRE_RADIOMETER] = "EMU65501"},
        .seed = 1,
        .inclinometer_tcp = over_tcp,
        .radiometer_hurry = 1,
        .radiometer_lapses = {.drift = 0.01, .misread_every = 3}};
}

bool day_rtu_open(const struct around *around, struct lane *lane)
{
    struct wire_options options = options_of(around, false);
    rtu.lane = lane;
    rtu.inclinometer = inclinometer_create(&options, NULL);
    if (!rtu.inclinometer)
        return false;
    rtu.end = inclinometer_end(rtu.inclinometer);
    lane->path = "/dev/ttyRTU";
    lane->serve = serve_rtu;
    lane->strike = strike_rtu;
    return true;
}

bool day_radiometer_open(const struct around *around, struct lane *lane)
{
    struct wire_options options = options_of(around, false);
    radiometer.lane = lane;
    radiometer.radiometer = radiometer_create(&options, NULL);
    if (!radiometer.radiometer)
        return false;
    radiometer.end = radiometer_end(radiometer.radiometer);
    lane->path = "/dev/ttyPR655";
    lane->serve = serve_radiometer;
    lane->strike = strike_radiometer;
    return true;
}

static struct line *line_at(const char *path)
{
    return !present || !present->path           ? NULL
           : strcmp(path, present->path)        ? NULL
           : present->serve == serve_rtu        ? &rtu
           : present->serve == serve_radiometer ? &radiometer
                                                : NULL;
}

static int open_line(struct line *l)
{
    int ends[2], fault = l->lane->fault;
    errno = fault == WIRE_UNPLUGGED   ? ENOENT
            : fault == WIRE_FORBIDDEN ? EACCES
            : fault == DAY_BUSY       ? EBUSY
                                      : 0;
    if (errno || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends) != 0)
        return -1;
    shut(&l->far);
    l->near = ends[0];
    l->far = ends[1];
    l->end.plugged(l->end.context, l->far);
    return l->near;
}

// ---- Modbus TCP ----------------------------------------------------------------

// The connections that are there, and come, stay open and dead.
static void leave_for_dead(int fd)
{
    if (tcp.dead_count == DEAD_MOST)
        abort();
    tcp.dead[tcp.dead_count++] = fd;
}

static void bury(void)
{
    int kept = 0;
    for (int i = 0; i < tcp.dead_count; i++)
        if (is_ready(tcp.dead[i], POLLRDHUP, 0))
            close(tcp.dead[i]);
        else
            tcp.dead[kept++] = tcp.dead[i];
    tcp.dead_count = kept;
}

// The driver connects: its connection arrives before anything else happens.
static void take_connection(int near)
{
    struct line *l = &tcp.line;
    is_ready(near, POLLOUT, ARRIVAL_MS);
    if (tcp.listener < 0 || !is_ready(tcp.listener, POLLIN, ARRIVAL_MS))
        return;
    int fd = accept4(tcp.listener, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd >= 0 && l->lane->fault == WIRE_HALF_OPEN) {
        leave_for_dead(fd);
    } else if (fd >= 0) {
        shut(&l->far);
        l->far = fd;
        l->busy = false;
        tcp.heard = tcp.asked;
        l->end.plugged(l->end.context, fd);
    }
}

static int64_t nobody_hears(void)
{
    tcp.heard = tcp.asked;
    return INT64_MAX;
}

static int64_t serve_tcp(int fd)
{
    struct line *l = &tcp.line;
    bury();
    if (l->far < 0)
        return nobody_hears();
    bool asked = tcp.asked > tcp.heard;
    bool readable = !l->busy && is_ready(l->far, POLLIN, asked ? ARRIVAL_MS : 0);
    if (readable && has_hung_up(l->far)) {
        shut(&l->far);
        return nobody_hears();
    }
    tcp.heard += readable;
    int64_t again_ns = l->end.serve(l->end.context, l->far, readable, fault_of(l->lane));
    l->busy = again_ns != INT64_MAX;
    if (tcp.answered)
        is_ready(fd, POLLIN, ARRIVAL_MS);
    tcp.answered = false;
    return again_ns;
}

static bool at_port(int *fd, int port)
{
    struct sockaddr_in at = {.sin_family = AF_INET,
                             .sin_port = htons((uint16_t)port),
                             .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    int yes = 1;
    *fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    return *fd >= 0 && !setsockopt(*fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) &&
           !bind(*fd, (struct sockaddr *)&at, sizeof at);
}

static void strike_tcp(int fault)
{
    if (fault == WIRE_UNPLUGGED) {
        shut(&tcp.listener);
        shut(&tcp.line.far);
        tcp.heard = tcp.asked;
    } else if (tcp.listener < 0 && (!at_port(&tcp.listener, tcp.port) || listen(tcp.listener, 8)))
        abort();
    if (fault == WIRE_HALF_OPEN && tcp.line.far >= 0) {
        leave_for_dead(tcp.line.far);
        tcp.line.far = -1;
    }
}

// The keeper is bound and never listens, so that nobody else gets the port
// while the gateway is away.
bool day_tcp_open(const struct around *around, struct lane *lane)
{
    struct wire_options options = options_of(around, true);
    struct sockaddr_in at;
    socklen_t size = sizeof at;
    tcp.line.lane = lane;
    tcp.line.inclinometer = inclinometer_create(&options, NULL);
    if (!tcp.line.inclinometer || !at_port(&tcp.keeper, 0) ||
        getsockname(tcp.keeper, (struct sockaddr *)&at, &size))
        return false;
    tcp.line.end = inclinometer_end(tcp.line.inclinometer);
    tcp.port = ntohs(at.sin_port);
    snprintf(tcp.path, sizeof tcp.path, "127.0.0.1:%d", tcp.port);
    lane->path = tcp.path;
    lane->serve = serve_tcp;
    lane->strike = strike_tcp;
    strike_tcp(WIRE_FINE);
    return true;
}

void day_lines_close(void)
{
    shut(&rtu.far);
    shut(&radiometer.far);
    shut(&tcp.line.far);
    shut(&tcp.listener);
    shut(&tcp.keeper);
    while (tcp.dead_count > 0)
        close(tcp.dead[--tcp.dead_count]);
    inclinometer_destroy(rtu.inclinometer);
    inclinometer_destroy(tcp.line.inclinometer);
    radiometer_destroy(radiometer.radiometer);
}

// ---- what the operating system is asked ----------------------------------------

static bool is_far(int fd)
{
    return fd == rtu.far || fd == radiometer.far || fd == tcp.line.far;
}

static bool is_near(int fd)
{
    return present && ((present->serve == serve_rtu && fd == rtu.near) ||
                       (present->serve == serve_radiometer && fd == radiometer.near));
}

// 1 when fd has something to read within the lane's time, else 0.
static int await(int fd, int64_t until_ns)
{
    for (;;) {
        int64_t again_ns = INT64_MAX;
        if (!is_ready(fd, POLLIN, 0))
            again_ns = present->serve(fd);
        if (is_ready(fd, POLLIN, 0))
            return 1;
        if (present->now_ns >= until_ns)
            return 0;
        lane_pass(again_ns < until_ns ? again_ns : until_ns);
    }
}

// Whether a driver waits; the instruments themselves never do.
static bool waits(int fd)
{
    return present && present->serve && !is_far(fd);
}

// Under another name, since <poll.h> tells the compiler that poll() reads nothing.
int day_poll(struct pollfd *fds, nfds_t count, int timeout_ms) __asm__("poll");

int day_poll(struct pollfd *fds, nfds_t count, int timeout_ms)
{
    if (count == 1 && waits(fds->fd) && timeout_ms >= 0 && fds->events & POLLIN)
        await(fds->fd, present->now_ns + timeout_ms * NS_PER_MS);
    else if (count == 1 && waits(fds->fd) && timeout_ms >= 0)
        lane_wait(present->now_ns + timeout_ms * NS_PER_MS);
    struct timespec most = {timeout_ms / 1000, timeout_ms % 1000 * 1000000L};
    if (present)
        most = (struct timespec){0};
    return (int)syscall(SYS_ppoll, fds, count, timeout_ms < 0 && !present ? NULL : &most, NULL, 0);
}

int select(int count, fd_set *reads, fd_set *writes, fd_set *excepts, struct timeval *timeout)
{
    int fd = count - 1;
    bool reading = reads && fd >= 0 && FD_ISSET(fd, reads);
    if (reading && waits(fd) && timeout)
        await(fd, present->now_ns + timeout->tv_sec * NS_PER_S + timeout->tv_usec * NS_PER_US);
    struct timespec most = {0};
    if (timeout && !(present && reading))
        most = (struct timespec){timeout->tv_sec, timeout->tv_usec * 1000};
    return (int)syscall(SYS_pselect6, count, reads, writes, excepts, timeout ? &most : NULL, NULL);
}

ssize_t send(int fd, const void *bytes, size_t size, int flags)
{
    ssize_t sent = syscall(SYS_sendto, fd, bytes, size, flags, NULL, 0);
    if (present && present->serve == serve_tcp && sent > 0) {
        tcp.asked += !is_far(fd);
        tcp.answered = is_far(fd);
    }
    return sent;
}

int connect(int fd, const struct sockaddr *address, socklen_t size)
{
    int result = (int)syscall(SYS_connect, fd, address, size), number = errno;
    if (present && present->serve == serve_tcp && (!result || number == EINPROGRESS))
        take_connection(fd);
    errno = number;
    return result;
}

int open(const char *path, int flags, ...)
{
    va_list args;
    va_start(args, flags);
    unsigned mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(args, unsigned) : 0;
    va_end(args);
    struct line *l = line_at(path);
    return l ? open_line(l) : (int)syscall(SYS_openat, AT_FDCWD, path, flags, mode);
}

int ioctl(int fd, unsigned long request, ...)
{
    va_list args;
    va_start(args, request);
    void *argument = va_arg(args, void *);
    va_end(args);
    return is_near(fd) && request == TIOCEXCL ? 0 : (int)syscall(SYS_ioctl, fd, request, argument);
}

int tcgetattr(int fd, struct termios *out)
{
    static int (*real)(int, struct termios *);
    real = real ? real : dlsym(RTLD_NEXT, "tcgetattr");
    if (!is_near(fd))
        return real(fd, out);
    memset(out, 0, sizeof *out);
    return 0;
}

int tcsetattr(int fd, int actions, const struct termios *in)
{
    static int (*real)(int, int, const struct termios *);
    real = real ? real : dlsym(RTLD_NEXT, "tcsetattr");
    return is_near(fd) ? 0 : real(fd, actions, in);
}

int tcflush(int fd, int queue)
{
    static int (*real)(int, int);
    char bytes[256];
    real = real ? real : dlsym(RTLD_NEXT, "tcflush");
    if (!is_near(fd) && !is_far(fd))
        return real(fd, queue);
    while (recv(fd, bytes, sizeof bytes, MSG_DONTWAIT) > 0)
        continue;
    return 0;
}
