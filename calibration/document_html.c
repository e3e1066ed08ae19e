// SPDX-License-Identifier: Apache-2.0
// One HTML file that opens offline and prints well.
#include <stdlib.h>
#include <string.h>

#include "calibration/document.h"
#include "calibration/seal.h"
#include "calibration/svg.h"
#include "files/write.h"

static const char HEAD[] = "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>";
static const char STYLE[] =
    "</title>\n<style>body{font:14px/1.45 system-ui,sans-serif;max-width:64em;margin:2em auto;"
    "padding:0 1em;color:#1c1917}h1{font-size:1.7em}"
    "h2{margin-top:2em;border-bottom:1px solid #d6d3d1}table{border-collapse:collapse;margin:.6em "
    "0;"
    "font-variant-numeric:tabular-nums}td,th{padding:.15em .6em;text-align:right}"
    "td:first-child,th:first-child{text-align:left;white-space:nowrap}"
    "thead th{border-bottom:1px solid #78716c;vertical-align:bottom}"
    ".muted{color:#78716c;font-style:italic}.bad{color:#b91c1c}"
    ".note{background:#fef3c7;padding:.6em 1em;border-left:4px solid #d97706}"
    "svg.plot{width:100%;font-size:11px}" SVG_STYLE
    "img{max-width:320px;border:1px solid #a8a29e}pre{font-size:11px;overflow:auto;max-height:30em;"
    "background:#fafaf9;padding:1em}footer{margin-top:3em;color:#78716c;font-size:11px;"
    "overflow-wrap:anywhere}"
    "@media print{body{margin:0;max-width:none}pre{max-height:none;white-space:pre-wrap}"
    "h2{break-after:avoid}table,svg,img{break-inside:avoid}}</style></head><body>\n";

static const char *class_of(enum tone tone)
{
    switch (tone) {
    case TONE_PLAIN:
        return "";
    case TONE_MUTED:
        return " class=\"muted\"";
    case TONE_NOTE:
        return " class=\"note\"";
    case TONE_BAD:
        return " class=\"bad\"";
    }
    return "";
}

static struct document *begin(const char *title, const char *date, FILE *out)
{
    (void)date;
    struct document *d = calloc(1, sizeof *d);
    if (!d)
        return NULL;
    *d = (struct document){.writer = &document_html, .out = out};
    fputs(HEAD, out);
    svg_escaped(out, title);
    fputs(STYLE, out);
    return d;
}

static void heading(struct document *d, int level, const char *text)
{
    fprintf(d->out, "<h%d>", level);
    svg_escaped(d->out, text);
    fprintf(d->out, "</h%d>\n", level);
}

static void paragraph(struct document *d, enum tone tone, const char *text)
{
    fprintf(d->out, "<p%s>", class_of(tone));
    svg_escaped(d->out, text);
    fputs("</p>\n", d->out);
}

static void row(struct document *d, const struct document_table *t, int at, const char *tag)
{
    fprintf(d->out, "<tr%s>", class_of(t->tones[at + 1]));
    for (int c = 0; c < t->columns; c++) {
        fprintf(d->out, "<%s>", tag);
        svg_escaped(d->out, table_cell(t, at, c));
        fprintf(d->out, "</%s>", tag);
    }
    fputs("</tr>\n", d->out);
}

static void table(struct document *d, const struct document_table *t)
{
    fputs("<table><thead>", d->out);
    row(d, t, -1, "th");
    fputs("</thead><tbody>\n", d->out);
    for (int at = 0; at < t->rows; at++)
        row(d, t, at, "td");
    fputs("</tbody></table>\n", d->out);
}

static void chart(struct document *d, const char *svg, size_t size)
{
    fwrite(svg, 1, size, d->out);
}

static void picture(struct document *d, const char *path, const char *caption)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    size_t size;
    struct error err;
    unsigned char *bytes = (unsigned char *)file_read(path, 1 << 26, &size, &err);
    if (!bytes) {
        d->failure = d->failure.code ? d->failure : err;
        return;
    }
    fputs("<p><img alt=\"", d->out);
    svg_escaped(d->out, caption);
    fputs("\" src=\"data:image/png;base64,", d->out);
    for (size_t i = 0; i < size; i += 3) {
        unsigned group = (unsigned)bytes[i] << 16;
        group |= i + 1 < size ? (unsigned)bytes[i + 1] << 8 : 0;
        group |= i + 2 < size ? bytes[i + 2] : 0;
        char four[4] = {digits[group >> 18], digits[group >> 12 & 63],
                        i + 1 < size ? digits[group >> 6 & 63] : '=',
                        i + 2 < size ? digits[group & 63] : '='};
        fwrite(four, 1, 4, d->out);
    }
    fputs("\"></p>\n", d->out);
    free(bytes);
}

static void verbatim(struct document *d, const char *text, const char *where)
{
    (void)where;
    fputs("<pre>", d->out);
    svg_escaped(d->out, text);
    fputs("</pre>\n", d->out);
}

static void seal(struct document *d)
{
    fputs("<footer>" SEAL_BLANK "</footer>\n", d->out);
}

static void end(struct document *d)
{
    fputs("</body></html>\n", d->out);
}

const struct document_writer document_html = {begin,   heading,  paragraph, table, chart,
                                              picture, verbatim, seal,      end};
