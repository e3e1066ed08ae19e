// SPDX-License-Identifier: Apache-2.0
// The two instruments on serial lines, through unmodified libmodbus and as any
// other program would call them. Runs itself again under umockdev-wrapper.
#include <errno.h>
#include <fcntl.h>
#include <modbus.h>
#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <termios.h>

#include "base/error.h"

#include <cmocka.h> // last: its fail() is a macro

#include "tests/simulator/wire_here.h"

// ---- inclinometer ------------------------------------------------------------------

static modbus_t *open_inclinometer(void)
{
    modbus_t *client = modbus_new_rtu(in_folder("inclinometer"), 9600, 'N', 8, 1);
    assert_int_equal(modbus_set_slave(client, 0x50), 0);
    modbus_set_response_timeout(client, 0, SILENCE_MS * 1000);
    return client;
}

static void expect_tilt(modbus_t *client)
{
    uint16_t words[12];
    modbus_set_response_timeout(client, REPLY_MS / 1000, 0);
    assert_int_equal(modbus_read_registers(client, 0x34, 12, words), 12);
    assert_true(fabs((int16_t)words[9] / 32768.0 * 180 - 30) < 0.2); // noise 0.02 degrees
    assert_true(fabs((int16_t)words[1] / 2048.0 - 0.5) < 0.01);
    modbus_set_response_timeout(client, 0, SILENCE_MS * 1000);
}

static void close_inclinometer(modbus_t *client)
{
    modbus_close(client);
    modbus_free(client);
}

static void the_inclinometer_answers_through_libmodbus(void **state)
{
    (void)state;
    uint16_t word, number[6];
    modbus_t *client = open_inclinometer();
    assert_int_equal(modbus_connect(client), 0);
    expect_tilt(client);
    assert_int_equal(modbus_read_registers(client, 0x7F, 6, number), 6);
    assert_int_equal(number[0], 'E' << 8 | 'M');
    assert_int_equal(number[3], '0' << 8 | '1');
    assert_int_equal(modbus_write_register(client, 0x69, 0xB588), 1);
    assert_int_equal(modbus_write_register(client, 0x03, 9), 1);
    assert_int_equal(modbus_read_registers(client, 0x03, 1, &word), 1);
    assert_int_equal(word, 9);
    assert_int_equal(modbus_read_registers(client, 0x85, 1, &word), -1);
    assert_int_equal(errno, EMBXILADD);
    assert_int_equal(modbus_read_input_registers(client, 0x34, 1, &word), -1);
    assert_int_equal(errno, EMBXILFUN);
    modbus_set_slave(client, 0x51);
    assert_int_equal(modbus_read_registers(client, 0x34, 1, &word), -1);
    assert_int_equal(errno, ETIMEDOUT);
    close_inclinometer(client);
}

static int open_line(const char *name)
{
    int fd = open(in_folder(name), O_RDWR | O_NOCTTY);
    assert_true(fd >= 0);
    struct termios raw;
    tcgetattr(fd, &raw);
    cfmakeraw(&raw);
    tcsetattr(fd, TCSANOW, &raw);
    return fd;
}

static void without_permission_a_line_cannot_be_opened(void **state)
{
    (void)state;
    static const struct {
        enum wire_instrument instrument;
        const char *name;
    } lines[] = {{WIRE_INCLINOMETER, "inclinometer"}, {WIRE_RADIOMETER, "radiometer"}};
    for (int i = 0; i < 2; i++) {
        set_fault(lines[i].instrument, WIRE_UNPLUGGED);
        set_fault(lines[i].instrument, WIRE_FORBIDDEN);
        assert_int_equal(open(in_folder(lines[i].name), O_RDWR | O_NOCTTY), -1);
        assert_int_equal(errno, EACCES);
        set_fault(lines[i].instrument, WIRE_UNPLUGGED);
        assert_int_equal(open(in_folder(lines[i].name), O_RDWR | O_NOCTTY), -1);
        assert_int_equal(errno, ENOENT);
        set_fault(lines[i].instrument, WIRE_FINE);
        close(open_line(lines[i].name));
    }
}

static size_t read_for(int fd, char *text, size_t size, const char *end, int timeout_ms)
{
    size_t have = 0;
    text[0] = '\0';
    struct pollfd wait = {.fd = fd, .events = POLLIN};
    while (have + 1 < size && !(end && strstr(text, end)) && poll(&wait, 1, timeout_ms) == 1) {
        ssize_t n = read(fd, text + have, size - 1 - have);
        if (n <= 0)
            break;
        have += (size_t)n;
        text[have] = '\0';
    }
    return have;
}

static void the_inclinometer_s_frames_are_the_documented_ones(void **state)
{
    (void)state;
    char reply[64];
    int fd = open_line("inclinometer");
    assert_int_equal(write(fd, "\x50\x03\x00\x3D\x00\x03\x99\x86", 8), 8);
    assert_int_equal(read_for(fd, reply, sizeof(reply), NULL, SILENCE_MS), 11);
    assert_memory_equal(reply, "\x50\x03\x06", 3);
    assert_int_equal(write(fd, "\x50\x06\x00\x69\xB5\x88\x22\xA1", 8), 8); // unlock: echoed
    assert_int_equal(read_for(fd, reply, sizeof(reply), NULL, SILENCE_MS), 8);
    assert_memory_equal(reply, "\x50\x06\x00\x69\xB5\x88\x22\xA1", 8);
    close(fd);
}

static void the_inclinometer_s_faults_show(void **state)
{
    (void)state;
    uint16_t words[3];
    modbus_t *client = open_inclinometer();
    assert_int_equal(modbus_connect(client), 0);
    set_fault(WIRE_INCLINOMETER, WIRE_SILENT);
    assert_int_equal(modbus_read_registers(client, 0x3D, 3, words), -1);
    assert_int_equal(errno, ETIMEDOUT);
    set_fault(WIRE_INCLINOMETER, WIRE_SHORT);
    assert_int_equal(modbus_read_registers(client, 0x3D, 3, words), -1);
    modbus_flush(client);
    set_fault(WIRE_INCLINOMETER, WIRE_GARBAGE);
    assert_int_equal(modbus_read_registers(client, 0x3D, 3, words), -1);
    modbus_flush(client);
    set_fault(WIRE_INCLINOMETER, WIRE_STALL);
    assert_int_equal(modbus_read_registers(client, 0x3D, 3, words), -1);
    assert_int_equal(errno, EMBXSBUSY);
    set_fault(WIRE_INCLINOMETER, WIRE_FINE);
    expect_tilt(client);
    close_inclinometer(client);
}

static int read_errno(modbus_t *client)
{
    uint16_t words[3];
    errno = 0;
    int count = modbus_read_registers(client, 0x3D, 3, words);
    int number = errno;
    modbus_flush(client);
    return count == 3 ? 0 : number;
}

static void the_inclinometer_says_every_exception(void **state)
{
    (void)state;
    const struct {
        enum wire_fault fault;
        int number;
    } rows[] = {{WIRE_BAD_FUNCTION, EMBXILFUN}, {WIRE_BAD_ADDRESS, EMBXILADD},
                {WIRE_BAD_VALUE, EMBXILVAL},    {WIRE_DEVICE_FAILURE, EMBXSFAIL},
                {WIRE_BAD_CRC, EMBBADCRC},      {WIRE_WRONG_UNIT, EMBBADSLAVE},
                {WIRE_HALF_OPEN, ETIMEDOUT}};
    modbus_t *client = open_inclinometer();
    assert_int_equal(modbus_connect(client), 0);
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        set_fault(WIRE_INCLINOMETER, rows[i].fault);
        assert_int_equal(read_errno(client), rows[i].number);
        set_fault(WIRE_INCLINOMETER, WIRE_FINE);
        expect_tilt(client);
    }
    close_inclinometer(client);
}

static void every_second_answer_is_dropped(void **state)
{
    (void)state;
    modbus_t *client = open_inclinometer();
    assert_int_equal(modbus_connect(client), 0);
    set_fault(WIRE_INCLINOMETER, WIRE_DROPPED);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(read_errno(client), 0);
        assert_int_equal(read_errno(client), ETIMEDOUT);
    }
    set_fault(WIRE_INCLINOMETER, WIRE_FINE);
    expect_tilt(client);
    close_inclinometer(client);
}

static void a_late_answer_comes_when_nobody_waits(void **state)
{
    (void)state;
    uint16_t words[3];
    modbus_t *client = open_inclinometer();
    assert_int_equal(modbus_connect(client), 0);
    set_fault(WIRE_INCLINOMETER, WIRE_LATE);
    assert_int_equal(modbus_read_registers(client, 0x3D, 3, words), -1);
    assert_int_equal(errno, ETIMEDOUT);
    struct pollfd wait = {.fd = modbus_get_socket(client), .events = POLLIN};
    assert_int_equal(poll(&wait, 1, 2 * REPLY_MS), 1);
    set_fault(WIRE_INCLINOMETER, WIRE_FINE);
    usleep(1000 * SILENCE_MS); // until all of it has come
    modbus_flush(client);
    expect_tilt(client);
    close_inclinometer(client);
}

static void the_inclinometer_s_line_breaks_and_returns_ten_times(void **state)
{
    (void)state;
    uint16_t word;
    for (int cycle = 0; cycle < 10; cycle++) {
        modbus_t *client = open_inclinometer();
        assert_int_equal(modbus_connect(client), 0);
        expect_tilt(client);
        set_fault(WIRE_INCLINOMETER, WIRE_UNPLUGGED);
        assert_int_equal(modbus_read_registers(client, 0x34, 1, &word), -1);
        close_inclinometer(client);
        client = open_inclinometer();
        assert_int_equal(modbus_connect(client), -1);
        close_inclinometer(client);
        set_fault(WIRE_INCLINOMETER, WIRE_FINE);
    }
}

// ---- radiometer ----------------------------------------------------------------------

static const char *tell(int fd, const char *text, const char *end, int timeout_ms)
{
    static char reply[4096];
    assert_int_equal(write(fd, text, strlen(text)), (ssize_t)strlen(text));
    read_for(fd, reply, sizeof(reply), end, timeout_ms);
    return reply;
}

static void the_radiometer_measures_over_its_line(void **state)
{
    (void)state;
    int fd = open_line("radiometer");
    assert_string_equal(tell(fd, "PHOTO\r", "\r\n", REPLY_MS), " REMOTE MODE\r\n");
    assert_string_equal(tell(fd, "D110\r", "\r\n", REPLY_MS), "00000,EMU65500123\r\n");
    double Y;
    assert_int_equal(sscanf(tell(fd, "M1\r", "\r\n", REPLY_MS), "00000,0,%lf,", &Y), 1);
    assert_true(fabs(Y / 72.98 - 1) < 0.01); // 683 lm/W x 106.86 nm x 0.001, noise 0.1 %
    const char *spectrum_text = tell(fd, "D5\r", " 780,", REPLY_MS);
    assert_memory_equal(spectrum_text, "00000,0,", 8);
    assert_non_null(strstr(spectrum_text, "\r\n 380,"));
    tell(fd, "Q\r", "\r\n", SILENCE_MS);
    close(fd);
}

static void the_radiometer_s_faults_show(void **state)
{
    (void)state;
    int fd = open_line("radiometer");
    tell(fd, "PHOTO\r", "\r\n", REPLY_MS);
    set_fault(WIRE_RADIOMETER, WIRE_STALL);
    assert_string_equal(tell(fd, "M1\r", "\r\n", REPLY_MS), "-0001\r\n");
    set_fault(WIRE_RADIOMETER, WIRE_WEAK_LIGHT);
    assert_string_equal(tell(fd, "M1\r", "\r\n", REPLY_MS), "-0008\r\n");
    set_fault(WIRE_RADIOMETER, WIRE_OVERLOAD);
    assert_string_equal(tell(fd, "M1\r", "\r\n", REPLY_MS), "-0002\r\n");
    set_fault(WIRE_RADIOMETER, WIRE_SILENT);
    assert_string_equal(tell(fd, "M1\r", "\r\n", SILENCE_MS), "");
    set_fault(WIRE_RADIOMETER, WIRE_SHORT);
    assert_string_equal(tell(fd, "D110\r", "\r\n", SILENCE_MS), "00000,EMU");
    set_fault(WIRE_RADIOMETER, WIRE_GARBAGE);
    assert_string_not_equal(tell(fd, "D110\r", "\r\n", SILENCE_MS), "00000,EMU65500123\r\n");
    set_fault(WIRE_RADIOMETER, WIRE_FINE);
    assert_string_equal(tell(fd, "D110\r", "\r\n", REPLY_MS), "00000,EMU65500123\r\n");
    close(fd);
}

static void the_radiometer_s_line_breaks_and_returns_ten_times(void **state)
{
    (void)state;
    char byte;
    for (int cycle = 0; cycle < 10; cycle++) {
        int fd = open_line("radiometer");
        assert_string_equal(tell(fd, "PHOTO\r", "\r\n", REPLY_MS), " REMOTE MODE\r\n");
        set_fault(WIRE_RADIOMETER, WIRE_UNPLUGGED);
        assert_true(read(fd, &byte, 1) <= 0);
        close(fd);
        assert_int_equal(access(in_folder("radiometer"), F_OK), -1);
        set_fault(WIRE_RADIOMETER, WIRE_FINE);
    }
}

int main(int argc, char **argv)
{
    (void)argc;
    if (under_umockdev(argv[0]))
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_permission_a_line_cannot_be_opened),
        cmocka_unit_test(the_inclinometer_answers_through_libmodbus),
        cmocka_unit_test(the_inclinometer_s_frames_are_the_documented_ones),
        cmocka_unit_test(the_inclinometer_s_faults_show),
        cmocka_unit_test(the_inclinometer_says_every_exception),
        cmocka_unit_test(every_second_answer_is_dropped),
        cmocka_unit_test(a_late_answer_comes_when_nobody_waits),
        cmocka_unit_test(the_inclinometer_s_line_breaks_and_returns_ten_times),
        cmocka_unit_test(the_radiometer_measures_over_its_line),
        cmocka_unit_test(the_radiometer_s_faults_show),
        cmocka_unit_test(the_radiometer_s_line_breaks_and_returns_ten_times),
    };
    return cmocka_run_group_tests(tests, start, stop);
}
