// SPDX-License-Identifier: Apache-2.0
// A setting is a table row: section, name, field, range, unit, one sentence.
// Parsing, error texts, help, manual page and writing back come from the row.
#ifndef BASE_SETTINGS_H
#define BASE_SETTINGS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "base/error.h"

enum setting_type {
    SETTING_DOUBLE, // double
    SETTING_INT,    // int
    SETTING_BOOL,   // bool, "yes" or "no"
    SETTING_TEXT,   // char[size], any text that fits
    SETTING_ENUM,   // int, one of choices
    SETTING_VECTOR, // double[count], separated by spaces
};

struct setting {
    const char *name; // "tilt_offset_deg"; NULL ends a table
    enum setting_type type;
    size_t offset;              // of the field in the struct
    size_t size;                // TEXT: bytes of the field; VECTOR: number of elements
    double least, most;         // allowed range (DOUBLE, INT, VECTOR elements)
    const char *unit;           // "m", "us"; "" without
    const char *const *choices; // ENUM: NULL-terminated names, index = value
    const char *preset;         // value as text when the file does not say; NULL = must be given
    const char *help;           // one sentence
};

#define SETTING_FIELD(type, field) offsetof(type, field)
#define SETTING_SIZE(type, field) sizeof(((type *)0)->field)

// One section of a settings file and the struct it fills.
struct settings_section {
    const char *name; // "[booth]"'s "booth"
    const struct setting *rows;
    void *target;
};

// Fills target with every preset of rows. A row without a preset leaves its
// field zero.
void settings_preset(const struct setting *rows, void *target);

// Sets one field from text. Error text (CONFIG) without file and line, such as
// "integration_us: 0 is outside 1000..65535000 us".
bool settings_set(const struct setting *rows, void *target, const char *name, const char *text,
                  struct error *err);

// The field as text, in a form settings_set reads back to the same value.
void settings_get(const struct setting *row, const void *target, char *text, size_t size);

// The row of that name, or NULL.
const struct setting *settings_find(const struct setting *rows, const char *name);

// Prints a section with one comment line per row: help, unit, range, preset.
void settings_describe(const struct settings_section *section, FILE *out);

// Writes "[name]" and "key = value" lines for a filled struct.
void settings_write(const struct settings_section *section, FILE *out);

#endif
