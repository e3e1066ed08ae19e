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

// Writes all sections, each with every key, by write-fsync-rename. Refuses
// (CONFIG) a value that ini_load would not take back: outside its range, or
// text with line ends or with blanks at its ends.
bool ini_save(const char *path, const struct settings_section *sections, struct error *err);

#endif
