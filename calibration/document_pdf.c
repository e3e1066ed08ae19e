// SPDX-License-Identifier: Apache-2.0
// PDF on A4 through cairo, text through Pango, charts through librsvg.
#include <cairo-pdf.h>
#include <librsvg/rsvg.h>
#include <math.h>
#include <pango/pangocairo.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/document.h"
#include "calibration/seal.h"
#include "calibration/svg.h"

#define PAGE_WIDTH 595.276
#define PAGE_HEIGHT 841.89
#define MARGIN 42.0
#define TEXT_WIDTH (PAGE_WIDTH - 2 * MARGIN)
#define TEXT_POINTS 9.0
#define TABLE_POINTS 7.5
#define CELL_GAP 8.0
#define PICTURE_WIDTH 200.0
#define CHART_HEIGHT 210.0

// SVG of svg.h knows its colours from the page it stands in.
static const char CHART_STYLE[] = "svg{font-family:sans-serif;font-size:11px}" SVG_STYLE;
static const char NAMESPACE[] = "<svg xmlns=\"http://www.w3.org/2000/svg\"";

struct pdf {
    struct document document;
    cairo_surface_t *surface;
    cairo_t *cr;
    double y;
    int page;
};

static struct pdf *pdf_of(struct document *d)
{
    return (struct pdf *)d;
}

static cairo_status_t to_file(void *closure, const unsigned char *bytes, unsigned size)
{
    return fwrite(bytes, 1, size, closure) == size ? CAIRO_STATUS_SUCCESS
                                                   : CAIRO_STATUS_WRITE_ERROR;
}

static struct document *begin(const char *title, const char *date, FILE *out)
{
    struct pdf *p = calloc(1, sizeof *p);
    if (!p)
        return NULL;
    p->document = (struct document){.writer = &document_pdf, .out = out};
    p->surface = cairo_pdf_surface_create_for_stream(to_file, out, PAGE_WIDTH, PAGE_HEIGHT);
    cairo_pdf_surface_set_metadata(p->surface, CAIRO_PDF_METADATA_TITLE, title);
    if (*date)
        cairo_pdf_surface_set_metadata(p->surface, CAIRO_PDF_METADATA_CREATE_DATE, date);
    p->cr = cairo_create(p->surface);
    p->y = MARGIN;
    p->page = 1;
    return &p->document;
}

// ---- text --------------------------------------------------------------------------

static void set_tone(struct pdf *p, enum tone tone)
{
    switch (tone) {
    case TONE_PLAIN:
        cairo_set_source_rgb(p->cr, 0.11, 0.10, 0.09);
        return;
    case TONE_MUTED:
        cairo_set_source_rgb(p->cr, 0.47, 0.44, 0.42);
        return;
    case TONE_NOTE:
        cairo_set_source_rgb(p->cr, 0.60, 0.33, 0.02);
        return;
    case TONE_BAD:
        cairo_set_source_rgb(p->cr, 0.73, 0.11, 0.11);
        return;
    }
}

static PangoLayout *layout_of(struct pdf *p, const char *text, double points, bool bold)
{
    PangoLayout *layout = pango_cairo_create_layout(p->cr);
    PangoFontDescription *font = pango_font_description_from_string("Sans");
    pango_font_description_set_absolute_size(font, points * PANGO_SCALE);
    if (bold)
        pango_font_description_set_weight(font, PANGO_WEIGHT_BOLD);
    pango_layout_set_font_description(layout, font);
    pango_font_description_free(font);
    pango_layout_set_text(layout, text, -1);
    return layout;
}

static void size_of(PangoLayout *layout, double *width, double *height)
{
    int w, h;
    pango_layout_get_size(layout, &w, &h);
    *width = (double)w / PANGO_SCALE;
    *height = (double)h / PANGO_SCALE;
}

static void number_page(struct pdf *p)
{
    char text[16];
    double w, h;
    snprintf(text, sizeof text, "%d", p->page);
    PangoLayout *layout = layout_of(p, text, TABLE_POINTS, false);
    size_of(layout, &w, &h);
    set_tone(p, TONE_MUTED);
    cairo_move_to(p->cr, PAGE_WIDTH - MARGIN - w, PAGE_HEIGHT - MARGIN / 2 - h);
    pango_cairo_show_layout(p->cr, layout);
    g_object_unref(layout);
}

static void turn_page(struct pdf *p)
{
    number_page(p);
    cairo_show_page(p->cr);
    p->y = MARGIN;
    p->page++;
}

static void need(struct pdf *p, double height)
{
    if (p->y + height > PAGE_HEIGHT - MARGIN && p->y > MARGIN)
        turn_page(p);
}

static void flow(struct pdf *p, PangoLayout *layout, enum tone tone, double after)
{
    double w, h;
    pango_layout_set_width(layout, (int)(TEXT_WIDTH * PANGO_SCALE));
    pango_layout_set_wrap(layout, PANGO_WRAP_WORD_CHAR);
    size_of(layout, &w, &h);
    need(p, h);
    set_tone(p, tone);
    cairo_move_to(p->cr, MARGIN, p->y);
    pango_cairo_show_layout(p->cr, layout);
    p->y += h + after;
    g_object_unref(layout);
}

static void heading(struct document *d, int level, const char *text)
{
    static const double points[] = {18, 13, 10.5};
    struct pdf *p = pdf_of(d);
    double size = points[level - 1];
    need(p, 6 * size); // not alone at the foot of a page
    if (p->y > MARGIN)
        p->y += size * 0.7;
    flow(p, layout_of(p, text, size, true), TONE_PLAIN, 4);
}

static void paragraph(struct document *d, enum tone tone, const char *text)
{
    struct pdf *p = pdf_of(d);
    flow(p, layout_of(p, text, TEXT_POINTS, false), tone, 5);
}

// ---- tables --------------------------------------------------------------------------

static double natural_widths(struct pdf *p, const struct document_table *t, double points,
                             double *widths)
{
    double all = 0;
    for (int c = 0; c < t->columns; c++) {
        widths[c] = 0;
        for (int row = -1; row < t->rows; row++) {
            double w, h;
            PangoLayout *layout = layout_of(p, table_cell(t, row, c), points, row < 0);
            size_of(layout, &w, &h);
            widths[c] = fmax(widths[c], w);
            g_object_unref(layout);
        }
        all += widths[c] + (c ? CELL_GAP : 0);
    }
    return all;
}

static void table_line(struct pdf *p, const struct document_table *t, int row, double points,
                       const double *widths)
{
    double x = MARGIN, most = 0;
    set_tone(p, t->tones[row + 1]);
    for (int c = 0; c < t->columns; c++) {
        double w, h;
        PangoLayout *layout = layout_of(p, table_cell(t, row, c), points, row < 0);
        size_of(layout, &w, &h);
        cairo_move_to(p->cr, c ? x + widths[c] - w : x, p->y);
        pango_cairo_show_layout(p->cr, layout);
        g_object_unref(layout);
        x += widths[c] + CELL_GAP;
        most = fmax(most, h);
    }
    p->y += most + 1.5;
    if (row < 0) {
        cairo_set_line_width(p->cr, 0.5);
        cairo_move_to(p->cr, MARGIN, p->y);
        cairo_line_to(p->cr, x - CELL_GAP, p->y);
        cairo_stroke(p->cr);
        p->y += 2;
    }
}

static void table(struct document *d, const struct document_table *t)
{
    struct pdf *p = pdf_of(d);
    double *widths = calloc((size_t)t->columns, sizeof *widths), points = TABLE_POINTS;
    if (!widths) {
        fail(&d->failure, ERROR_SYSTEM, "out of memory for a table");
        return;
    }
    double all = natural_widths(p, t, points, widths);
    if (all > TEXT_WIDTH) {
        points *= TEXT_WIDTH / all * 0.98;
        natural_widths(p, t, points, widths);
    }
    need(p, 6 * points);
    table_line(p, t, -1, points, widths);
    for (int row = 0; row < t->rows; row++) {
        if (p->y + 2 * points > PAGE_HEIGHT - MARGIN) {
            turn_page(p);
            table_line(p, t, -1, points, widths);
        }
        table_line(p, t, row, points, widths);
    }
    p->y += 7;
    free(widths);
}

// ---- charts and pictures ---------------------------------------------------------------

// Width over height of the view box.
static bool aspect_of(RsvgHandle *handle, double *aspect)
{
    gboolean has_width, has_height, has_box;
    RsvgLength width, height;
    RsvgRectangle box;
    rsvg_handle_get_intrinsic_dimensions(handle, &has_width, &width, &has_height, &height, &has_box,
                                         &box);
    *aspect = has_box && box.height > 0 ? box.width / box.height : 0;
    return *aspect > 0;
}

static bool draw_chart(struct pdf *p, RsvgHandle *handle)
{
    double aspect;
    bool fine = rsvg_handle_set_stylesheet(handle, (const guint8 *)CHART_STYLE, strlen(CHART_STYLE),
                                           NULL) &&
                aspect_of(handle, &aspect);
    if (!fine)
        return false;
    double height = fmin(TEXT_WIDTH / aspect, CHART_HEIGHT), width = height * aspect;
    need(p, height);
    RsvgRectangle place = {MARGIN, p->y, width, height};
    p->y += height + 6;
    return rsvg_handle_render_document(handle, p->cr, &place, NULL);
}

static void chart(struct document *d, const char *svg, size_t size)
{
    static const char PLAIN[] = "<svg";
    struct pdf *p = pdf_of(d);
    char *text = malloc(size + sizeof NAMESPACE);
    bool fine = text && size > strlen(PLAIN) && !memcmp(svg, PLAIN, strlen(PLAIN));
    if (fine) {
        memcpy(text, NAMESPACE, strlen(NAMESPACE));
        memcpy(text + strlen(NAMESPACE), svg + strlen(PLAIN), size - strlen(PLAIN));
        size += strlen(NAMESPACE) - strlen(PLAIN);
        RsvgHandle *handle = rsvg_handle_new_from_data((const guint8 *)text, size, NULL);
        fine = handle && draw_chart(p, handle);
        g_clear_object(&handle);
    }
    free(text);
    if (!fine && !d->failure.code)
        fail(&d->failure, ERROR_DATA, "a chart cannot be drawn");
}

static void picture(struct document *d, const char *path, const char *caption)
{
    struct pdf *p = pdf_of(d);
    cairo_surface_t *png = cairo_image_surface_create_from_png(path);
    if (cairo_surface_status(png)) {
        if (!d->failure.code)
            fail(&d->failure, ERROR_CONFIG, "%s: %s", path,
                 cairo_status_to_string(cairo_surface_status(png)));
        cairo_surface_destroy(png);
        return;
    }
    double scale = PICTURE_WIDTH / cairo_image_surface_get_width(png);
    double height = scale * cairo_image_surface_get_height(png);
    need(p, height + 20);
    cairo_save(p->cr);
    cairo_translate(p->cr, MARGIN, p->y);
    cairo_scale(p->cr, scale, scale);
    cairo_set_source_surface(p->cr, png, 0, 0);
    cairo_paint(p->cr);
    cairo_restore(p->cr);
    cairo_surface_destroy(png);
    p->y += height + 3;
    flow(p, layout_of(p, caption, TABLE_POINTS, false), TONE_MUTED, 6);
}

static void verbatim(struct document *d, const char *text, const char *where)
{
    char said[256];
    (void)text;
    snprintf(said, sizeof said, "See %s.", where);
    paragraph(d, TONE_MUTED, said);
}

static void seal(struct document *d)
{
    paragraph(d, TONE_MUTED, "The seal of this file is its last line, behind the end of the PDF.");
}

static void end(struct document *d)
{
    struct pdf *p = pdf_of(d);
    number_page(p);
    cairo_destroy(p->cr);
    cairo_surface_finish(p->surface);
    if (cairo_surface_status(p->surface) && !d->failure.code)
        fail(&d->failure, ERROR_SYSTEM, "the PDF cannot be written");
    cairo_surface_destroy(p->surface);
    fputs("%" SEAL_BLANK "\n", d->out);
}

const struct document_writer document_pdf = {begin,   heading,  paragraph, table, chart,
                                             picture, verbatim, seal,      end};
