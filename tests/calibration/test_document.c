// SPDX-License-Identifier: Apache-2.0
#include "calibration/document.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#undef fail

#include "calibration/seal.h"
#include "calibration/svg.h"
#include "files/png.h"
#include "tests/fakes/folder.h"

// All that a document can say; the caller frees it.
static char *everything(enum document_form form, const char *picture, size_t *size,
                        struct error *err)
{
    char *bytes = NULL, *svg = NULL;
    size_t svg_size;
    FILE *out = open_memstream(&bytes, size), *plot = open_memstream(&svg, &svg_size);
    struct document *d = document_begin(form, "a <title>", "2026-01-31T12:34:56Z", out, err);
    struct document_table t;
    const double x[] = {400, 500}, y[] = {1, 2};
    const struct svg_series series = {"one & two", "#123456", 2, x, y};
    svg_lines(plot, "nm", "W", &series, 1);
    fclose(plot);
    assert_non_null(d);
    document_heading(d, 1, "Heading %d", 1);
    document_paragraph(d, TONE_NOTE, "a<b & c, ΔE00 %.1f", 0.5);
    table_begin(&t, "patch\tΔL\tΔC");
    for (int i = 0; i < 90; i++) // more than a page
        table_row(&t, i ? TONE_PLAIN : TONE_BAD, "patch <%d>\t%+.2f\t%+.2f", i, 0.1 * i, -0.1 * i);
    document_table(d, &t);
    document_chart(d, svg, svg_size);
    if (picture)
        document_picture(d, picture, "a picture");
    document_verbatim(d, "{\"raw\": 1}", "raw.json");
    document_seal(d);
    document_end(d, err);
    fclose(out);
    free(svg);
    return bytes;
}

static void html_fetches_nothing_and_escapes_everything(void **state)
{
    (void)state;
    size_t size;
    struct error err = {0};
    char *text = everything(DOCUMENT_HTML, NULL, &size, &err);
    assert_int_equal(err.code, ERROR_NONE);
    assert_null(strstr(text, "http"));
    assert_null(strstr(text, "<script"));
    assert_null(strstr(text, "<link"));
    assert_null(strstr(text, "a<b"));
    assert_non_null(strstr(text, "a&lt;b &amp; c, ΔE00 0.5"));
    assert_non_null(strstr(text, "<td>patch &lt;7&gt;</td>"));
    assert_non_null(strstr(text, "<svg"));
    assert_true(seal_fill(text, size, NULL));
    free(text);
}

static void text_stands_in_columns_and_leaves_charts_out(void **state)
{
    (void)state;
    size_t size;
    struct error err = {0};
    char *text = everything(DOCUMENT_TEXT, NULL, &size, &err);
    assert_int_equal(err.code, ERROR_NONE);
    assert_null(strstr(text, "<svg"));
    assert_non_null(strstr(text, "  patch          ΔL     ΔC\n"));
    assert_non_null(strstr(text, "! patch <0>   +0.00  -0.00\n"));
    assert_non_null(strstr(text, "See raw.json."));
    assert_true(seal_fill(text, size, NULL));
    free(text);
}

static void pdf_is_sealed_behind_its_end(void **state)
{
    (void)state;
    size_t size;
    struct error err = {0};
    struct folder folder;
    uint8_t rgb[4 * 4 * 3] = {0};
    folder_open(&folder);
    const char *png = folder_at(&folder, "a.png");
    assert_true(png_save_rgb8(png, 4, 4, rgb, NULL));
    char *bytes = everything(DOCUMENT_PDF, png, &size, &err);
    if (err.code)
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    assert_memory_equal(bytes, "%PDF-", 5);
    assert_true(size > 1024 && memmem(bytes + size - 1024, 1024, "%%EOF", 5) != NULL);
    assert_true(seal_fill(bytes, size, NULL));
    assert_true(seal_check(bytes, size, NULL, NULL));
    free(bytes);
    folder_close(&folder);
}

static void the_same_words_give_the_same_pdf(void **state)
{
    (void)state;
    size_t size, again;
    struct error err = {0};
    char *one = everything(DOCUMENT_PDF, NULL, &size, &err);
    char *two = everything(DOCUMENT_PDF, NULL, &again, &err);
    assert_int_equal(size, again);
    assert_memory_equal(one, two, size);
    free(one);
    free(two);
}

static void a_missing_picture_fails_with_its_path(void **state)
{
    (void)state;
    const enum document_form forms[] = {DOCUMENT_HTML, DOCUMENT_PDF};
    for (int i = 0; i < 2; i++) {
        size_t size;
        struct error err = {0};
        free(everything(forms[i], "/nowhere/chart.png", &size, &err));
        assert_int_equal(err.code, ERROR_CONFIG);
        assert_non_null(strstr(err.text, "/nowhere/chart.png"));
    }
}

static void what_is_no_chart_fails_the_pdf(void **state)
{
    (void)state;
    char *bytes = NULL;
    size_t size;
    struct error err = {0};
    FILE *out = open_memstream(&bytes, &size);
    struct document *d = document_begin(DOCUMENT_PDF, "t", "", out, NULL);
    document_chart(d, "<p>no</p>", 9);
    assert_false(document_end(d, &err));
    assert_int_equal(err.code, ERROR_DATA);
    fclose(out);
    free(bytes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(html_fetches_nothing_and_escapes_everything),
        cmocka_unit_test(text_stands_in_columns_and_leaves_charts_out),
        cmocka_unit_test(pdf_is_sealed_behind_its_end),
        cmocka_unit_test(the_same_words_give_the_same_pdf),
        cmocka_unit_test(a_missing_picture_fails_with_its_path),
        cmocka_unit_test(what_is_no_chart_fails_the_pdf),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
