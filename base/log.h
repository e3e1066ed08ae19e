// SPDX-License-Identifier: Apache-2.0
// The programs' log: one line a call to standard error, with the journald
// priority prefix <N> when the journal listens (JOURNAL_STREAM is set), plain
// "program: text" on a terminal. Only main programs call it.
#ifndef BASE_LOG_H
#define BASE_LOG_H

// The numbers are those of syslog and sd-daemon(3).
enum log_level { LOG_LEVEL_ERROR = 3, LOG_LEVEL_WARNING = 4, LOG_LEVEL_NOTICE = 5, LOG_LEVEL_INFO = 6, LOG_LEVEL_DEBUG = 7 };

// Names the program and the least important level to print. Call once, first.
void log_init(const char *program, enum log_level least);

// Prints one line. Any thread; lines never mix.
void log_line(enum log_level level, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
