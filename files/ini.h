// SPDX-License-Identifier: Apache-2.0
// Settings files in INI form (as systemd writes them), read with libinih into
// the tables of base/settings.h. A comment is a line that begins with # or ;
// (none after a value); blanks before a key mean nothing; a line holds at most
// 65000 bytes.
#ifndef FILES_INI_H
#define FILES_INI_H

#include "base/settings.h"

// Fills the targets of all sections from a file. Every field first gets its
// preset. sections ends with a name of NULL. A section name ending in '*'
// ("material*") is not supported: one file holds each section once.
// Errors (CONFIG) name file, line, key, value and what is allowed: unknown
// section or key, a key given twice, a value out of range, a required key
// that is missing, bytes that are not text. Targets are undefined on failure.
bool ini_load(const char *path, const struct settings_section *sections, struct error *err);

// As ini_load, but a field that the file does not name keeps its value, and
// none must be named: ini_complete says what is
// missing. given (may be NULL) has an element
// for every row of every section, in their order; those the file names become
// true, the others stay.
bool ini_load_onto(const char *path, const struct settings_section *sections, bool *given,
                   struct error *err);

// The first row without a preset that is not given, as ini_load refuses it:
// false with err (CONFIG), naming path.
bool ini_complete(const char *path, const struct settings_section *sections, const bool *given,
                  struct error *err);

// Rows of all sections: elements of such a given.
size_t ini_rows(const struct settings_section *sections);

// Writes all sections, each with every key, by write-fsync-rename. Refuses
// (CONFIG) a value that ini_load would not take back: outside its range, or
// text with line ends or with blanks at its ends.
bool ini_save(const char *path, const struct settings_section *sections, struct error *err);

#endif
