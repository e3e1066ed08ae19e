// SPDX-License-Identifier: Apache-2.0
#include "calibration/display_export.h"

#include <lcms2.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "calibration/commands.h"
#include "config/display_file.h"
#include "files/write.h"

enum { FORWARD_SIDE = 33, INVERSE_SIDE = 41, CUBE_SIDE = 33 };

static const double FULL16 = 65535;

// ---- ICC -------------------------------------------------------------------

// A model and the way from its white to D50 and back.
struct adapted {
    const struct display_model *model;
    cmsCIEXYZ white; // Y = 1
    double luminance;
    struct mat3 to_d50, from_d50;
};

static bool adapt(const struct display_model *model, struct adapted *a, struct error *err)
{
    struct xyz w = display_forward(model, (struct counts){1, 1, 1});
    a->model = model;
    a->luminance = w.Y;
    a->white = (cmsCIEXYZ){w.X / w.Y, 1, w.Z / w.Y};
    for (int c = 0; c < 3; c++) {
        cmsCIEXYZ unit = {c == 0, c == 1, c == 2}, out;
        if (!cmsAdaptToIlluminant(&out, &a->white, cmsD50_XYZ(), &unit))
            return fail(err, ERROR_DATA, "the display's white cannot be adapted to D50");
        a->to_d50.m[0][c] = out.X;
        a->to_d50.m[1][c] = out.Y;
        a->to_d50.m[2][c] = out.Z;
    }
    return mat3_invert(a->to_d50, &a->from_d50) ||
           fail(err, ERROR_DATA, "the display's white cannot be adapted to D50");
}

static cmsInt32Number forward_node(const cmsUInt16Number in[], cmsUInt16Number out[], void *cargo)
{
    const struct adapted *a = cargo;
    struct xyz c =
        display_forward(a->model, (struct counts){in[0] / FULL16, in[1] / FULL16, in[2] / FULL16});
    struct vec3 v = mat3_apply(a->to_d50, (struct vec3){c.X, c.Y, c.Z});
    double k = 1 / a->luminance;
    cmsCIEXYZ relative = {v.x * k, v.y * k, v.z * k};
    cmsCIELab lab;
    cmsXYZ2Lab(NULL, &lab, &relative);
    cmsFloat2LabEncoded(out, &lab);
    return TRUE;
}

static cmsInt32Number inverse_node(const cmsUInt16Number in[], cmsUInt16Number out[], void *cargo)
{
    const struct adapted *a = cargo;
    cmsCIELab lab;
    cmsCIEXYZ relative;
    cmsLabEncoded2Float(&lab, in);
    cmsLab2XYZ(NULL, &relative, &lab);
    struct vec3 v = mat3_apply(a->from_d50, (struct vec3){relative.X, relative.Y, relative.Z});
    struct counts c = display_invert(a->model, (struct xyz){v.x * a->luminance, v.y * a->luminance,
                                                            v.z * a->luminance})
                          .counts;
    out[0] = (cmsUInt16Number)lrint(c.r * FULL16);
    out[1] = (cmsUInt16Number)lrint(c.g * FULL16);
    out[2] = (cmsUInt16Number)lrint(c.b * FULL16);
    return TRUE;
}

// A table between identity curves, as ICC wants them around it.
static bool write_table(cmsHPROFILE profile, cmsTagSignature tag, int side, cmsSAMPLER16 node,
                        struct adapted *a)
{
    cmsPipeline *pipeline = cmsPipelineAlloc(NULL, 3, 3);
    cmsStage *table = cmsStageAllocCLut16bit(NULL, (cmsUInt32Number)side, 3, 3, NULL);
    bool fine = pipeline && table && cmsStageSampleCLut16bit(table, node, a, 0);
    fine = fine &&
           cmsPipelineInsertStage(pipeline, cmsAT_BEGIN, cmsStageAllocToneCurves(NULL, 3, NULL));
    if (!fine || !cmsPipelineInsertStage(pipeline, cmsAT_END, table)) {
        cmsStageFree(table);
        fine = false;
    }
    fine = fine &&
           cmsPipelineInsertStage(pipeline, cmsAT_END, cmsStageAllocToneCurves(NULL, 3, NULL)) &&
           cmsWriteTag(profile, tag, pipeline);
    cmsPipelineFree(pipeline);
    return fine;
}

static bool write_text(cmsHPROFILE profile, cmsTagSignature tag, const char *text)
{
    cmsMLU *mlu = cmsMLUalloc(NULL, 1);
    bool fine = mlu && cmsMLUsetASCII(mlu, "en", "US", text) && cmsWriteTag(profile, tag, mlu);
    cmsMLUfree(mlu);
    return fine;
}

static bool write_tags(cmsHPROFILE profile, struct adapted *a)
{
    cmsCIEXYZ luminance = {0, a->luminance, 0};
    double chad[9];
    for (int i = 0; i < 9; i++)
        chad[i] = a->to_d50.m[i / 3][i % 3];
    cmsSetProfileVersion(profile, 4.3);
    cmsSetDeviceClass(profile, cmsSigDisplayClass);
    cmsSetColorSpace(profile, cmsSigRgbData);
    cmsSetPCS(profile, cmsSigLabData);
    cmsSetHeaderRenderingIntent(profile, INTENT_RELATIVE_COLORIMETRIC);
    return write_text(profile, cmsSigProfileDescriptionTag,
                      *a->model->name ? a->model->name : "boothd display model") &&
           write_text(profile, cmsSigCopyrightTag,
                      "made by boothd from measurements; no rights kept") &&
           cmsWriteTag(profile, cmsSigMediaWhitePointTag, cmsD50_XYZ()) &&
           cmsWriteTag(profile, cmsSigChromaticAdaptationTag, chad) &&
           cmsWriteTag(profile, cmsSigLuminanceTag, &luminance) &&
           write_table(profile, cmsSigAToB0Tag, FORWARD_SIDE, forward_node, a) &&
           write_table(profile, cmsSigBToA0Tag, INVERSE_SIDE, inverse_node, a);
}

static bool write_profile(cmsHPROFILE profile, const char *path, struct error *err)
{
    cmsUInt32Number size = 0;
    void *bytes = NULL;
    bool fine = cmsMD5computeID(profile) && cmsSaveProfileToMem(profile, NULL, &size) &&
                (bytes = malloc(size)) && cmsSaveProfileToMem(profile, bytes, &size);
    fine = fine ? whole_file_write(path, bytes, size, err)
                : fail(err, ERROR_SYSTEM, "%s: lcms2 could not make the profile", path);
    free(bytes);
    return fine;
}

bool display_export_icc(const struct display_model *model, const char *path, struct error *err)
{
    struct adapted a;
    if (!adapt(model, &a, err))
        return false;
    cmsHPROFILE profile = cmsCreateProfilePlaceholder(NULL);
    bool fine = (profile && write_tags(profile, &a)) ||
                fail(err, ERROR_SYSTEM, "%s: lcms2 could not make the profile", path);
    fine = fine && write_profile(profile, path, err);
    if (profile)
        cmsCloseProfile(profile);
    return fine;
}

// ---- .cube -----------------------------------------------------------------

// IEC 61966-2-1, linear sRGB to XYZ, Y = 1 for white.
static const struct mat3 SRGB = {
    {{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}};
static const double BISECTIONS = 40;

static double srgb_light(double v)
{
    return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

static struct display_inverse from_srgb(const struct display_model *m, double luminance, double r,
                                        double g, double b)
{
    struct vec3 v = mat3_apply(SRGB, (struct vec3){srgb_light(r), srgb_light(g), srgb_light(b)});
    return display_invert(m, (struct xyz){v.x * luminance, v.y * luminance, v.z * luminance});
}

// The most of the display's luminance at which sRGB's white is in gamut.
static double reached_scale(const struct display_model *m, double luminance)
{
    double low = 0, high = 1;
    if (from_srgb(m, luminance, 1, 1, 1).in_gamut)
        return 1;
    for (int i = 0; i < BISECTIONS; i++) {
        double middle = (low + high) / 2;
        bool in = from_srgb(m, luminance * middle, 1, 1, 1).in_gamut;
        low = in ? middle : low;
        high = in ? high : middle;
    }
    return low;
}

bool display_export_cube(const struct display_model *model, int size, const char *path,
                         double *scale, struct error *err)
{
    struct whole_file file;
    if (size < CUBE_LEAST || size > CUBE_MOST)
        return fail(err, ERROR_RANGE, "%d nodes a side: outside %d..%d", size, CUBE_LEAST,
                    CUBE_MOST);
    if (!whole_file_begin(&file, path, err))
        return false;
    double white = display_forward(model, (struct counts){1, 1, 1}).Y;
    double k = reached_scale(model, white), luminance = white * k;
    fprintf(file.stream,
            "# sRGB to counts of %s\n# white: D65 at %.4f cd/m2 (the display's own: %.4f)\n"
            "# boothd %s\nTITLE \"%s\"\nLUT_3D_SIZE %d\n",
            model->name, luminance, white, BOOTHD_VERSION, "boothd display model", size);
    for (int b = 0; b < size; b++)
        for (int g = 0; g < size; g++)
            for (int r = 0; r < size; r++) {
                double step = 1.0 / (size - 1);
                struct counts c = from_srgb(model, luminance, r * step, g * step, b * step).counts;
                fprintf(file.stream, "%.7f %.7f %.7f\n", c.r, c.g, c.b);
            }
    if (scale)
        *scale = k;
    return whole_file_commit(&file, err);
}

// ---- the command -----------------------------------------------------------

struct export_options {
    const char *model, *icc, *cube;
    int size;
};

static bool take_size(const char *text, int *size)
{
    const char *end = "";
    double v = NAN;
    bool fine =
        number_parse(text, &end, &v) && !*end && v >= CUBE_LEAST && v <= CUBE_MOST && v == rint(v);
    *size = fine ? (int)v : 0;
    if (!fine)
        command_bad_usage("boothcal display export: --size: %s is no whole number, %d..%d", text,
                          CUBE_LEAST, CUBE_MOST);
    return fine;
}

static int parse(int argc, char **argv, struct export_options *o)
{
    *o = (struct export_options){.size = CUBE_SIDE};
    for (int i = 1; i < argc; i++) {
        bool more = i + 1 < argc;
        if (!strcmp(argv[i], "--icc") && more)
            o->icc = argv[++i];
        else if (!strcmp(argv[i], "--cube") && more)
            o->cube = argv[++i];
        else if (!strcmp(argv[i], "--size") && more) {
            if (!take_size(argv[++i], &o->size))
                return COMMAND_USAGE;
        } else if (*argv[i] != '-' && !o->model)
            o->model = argv[i];
        else
            o->model = "";
    }
    if (o->model && *o->model && (o->icc || o->cube))
        return COMMAND_FINE;
    return command_bad_usage(
        "usage: boothcal display export D.ini [--icc OUT.icc] [--cube OUT.cube] [--size N]");
}

int display_exporting(int argc, char **argv)
{
    struct export_options o;
    struct error err = {0};
    int misuse = parse(argc, argv, &o);
    if (misuse)
        return misuse;
    double scale = 1;
    struct display_model *model = malloc(sizeof *model);
    bool fine = model || fail(&err, ERROR_SYSTEM, "out of memory");
    fine = fine && display_load(o.model, model, NULL, &err) &&
           (!o.icc || display_export_icc(model, o.icc, &err)) &&
           (!o.cube || display_export_cube(model, o.size, o.cube, &scale, &err));
    free(model);
    if (!fine)
        return command_failed(&err);
    if (scale == 1)
        return COMMAND_FINE;
    char warning[160];
    snprintf(warning, sizeof warning,
             "the display does not reach D65 at its own white's luminance: the .cube is scaled to "
             "%.1f %%",
             100 * scale);
    return command_warned(warning);
}
