// SPDX-License-Identifier: Apache-2.0
// Structs to JSON and back by tables: a field is a row, and what writes it
// reads it.
#ifndef CALIBRATION_FIELDS_H
#define CALIBRATION_FIELDS_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

#include "base/error.h"

enum field_kind {
    FIELD_NUMBER,  // double; NAN is null
    FIELD_WHOLE,   // int
    FIELD_FLAG,    // bool
    FIELD_TEXT,    // char[size]
    FIELD_NUMBERS, // double[size], such as a struct of doubles alone; NAN is null
    FIELD_OBJECT,  // a struct by rows
    FIELD_LIST,    // an array of structs of `size` bytes by rows; how many: an int at `count`
    FIELD_SERIES,  // double[most]; how many: an int at `count`
    FIELD_JSON,    // json_t *, a reference of the struct's own
};

struct field {
    const char *key; // NULL ends a table
    enum field_kind kind;
    size_t offset, size;
    const struct field *rows;
    size_t count; // offset of the int, LIST and SERIES
    int most;     // elements there is room for, LIST and SERIES
};

// Rows for struct OWNER, which the including file defines.
#define F_NUMBER(key, f)                                                                           \
    {                                                                                              \
        key, FIELD_NUMBER, offsetof(struct OWNER, f), 0, NULL, 0, 0                                \
    }
#define F_WHOLE(key, f)                                                                            \
    {                                                                                              \
        key, FIELD_WHOLE, offsetof(struct OWNER, f), 0, NULL, 0, 0                                 \
    }
#define F_FLAG(key, f)                                                                             \
    {                                                                                              \
        key, FIELD_FLAG, offsetof(struct OWNER, f), 0, NULL, 0, 0                                  \
    }
#define F_SIZE(f) sizeof(((struct OWNER *)0)->f)
#define F_TEXT(key, f)                                                                             \
    {                                                                                              \
        key, FIELD_TEXT, offsetof(struct OWNER, f), F_SIZE(f), NULL, 0, 0                          \
    }
#define F_NUMBERS(key, f)                                                                          \
    {                                                                                              \
        key, FIELD_NUMBERS, offsetof(struct OWNER, f), F_SIZE(f) / sizeof(double), NULL, 0, 0      \
    }
#define F_OBJECT(key, f, rows)                                                                     \
    {                                                                                              \
        key, FIELD_OBJECT, offsetof(struct OWNER, f), 0, rows, 0, 0                                \
    }
#define F_LIST(key, f, n, rows)                                                                    \
    {                                                                                              \
        key, FIELD_LIST, offsetof(struct OWNER, f), sizeof *((struct OWNER *)0)->f, rows,          \
            offsetof(struct OWNER, n), (int)(F_SIZE(f) / sizeof *((struct OWNER *)0)->f)           \
    }
#define F_SERIES(key, f, n)                                                                        \
    {                                                                                              \
        key, FIELD_SERIES, offsetof(struct OWNER, f), sizeof(double), NULL,                        \
            offsetof(struct OWNER, n), (int)(F_SIZE(f) / sizeof(double))                           \
    }
#define F_JSON(key, f)                                                                             \
    {                                                                                              \
        key, FIELD_JSON, offsetof(struct OWNER, f), 0, NULL, 0, 0                                  \
    }

// A new object with every row; NULL when a text is no UTF-8 or a number is infinite.
json_t *fields_as_json(const struct field *rows, const void *from);

// Fills `to` from an object. A key that is not there leaves its field as it is;
// one of another kind, or with more elements than there is room for, is
// refused (DATA), naming its place. FIELD_JSON takes a new reference.
bool fields_from_json(const struct field *rows, const json_t *from, void *to, struct error *err);

#endif
