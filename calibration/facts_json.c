// SPDX-License-Identifier: Apache-2.0
#include "calibration/facts_json.h"

#include <stdlib.h>
#include <string.h>

#include "files/write.h"

enum { FACTS_BYTES = 1 << 28 };
static const char KIND[] = "boothd session";

#define OWNER summary
const struct field summary_fields[] = {
    F_WHOLE("n", n),
    F_NUMBER("mean", mean),
    F_NUMBER("std", std),
    F_NUMBER("median", median),
    F_NUMBER("p90", p90),
    F_NUMBER("p95", p95),
    F_NUMBER("p99", p99),
    F_NUMBER("max", max),
    {0},
};
#undef OWNER

#define OWNER patch_report
const struct field patch_fields[] = {
    F_TEXT("name", name),
    F_NUMBERS("reference_cdm2", reference),
    F_NUMBERS("measured_cdm2", measured),
    F_NUMBERS("expected_cdm2", expected),
    F_NUMBERS("aimed_cdm2", aimed),
    F_NUMBERS("predicted_cdm2", predicted),
    F_NUMBERS("counts", counts),
    F_NUMBERS("full_relative", full),
    F_NUMBERS("bands_relative", bands),
    F_FLAG("in_gamut", in_gamut),
    F_WHOLE("reading", reading),
    F_NUMBER("de00_simulation", de_simulation),
    F_NUMBER("de00_published", de_published),
    F_NUMBER("de00_absolute", de_absolute),
    {0},
};
#undef OWNER

#define OWNER proof_summary
static const struct field proof_fields[] = {
    F_OBJECT("simulation", simulation, summary_fields),
    F_OBJECT("published", published, summary_fields),
    F_OBJECT("published_in_gamut", published_in_gamut, summary_fields),
    F_OBJECT("absolute", absolute, summary_fields),
    F_OBJECT("absolute_in_gamut", absolute_in_gamut, summary_fields),
    {0},
};
#undef OWNER

#define OWNER lamp_report
const struct field lamp_fields[] = {
    F_TEXT("name", name),
    F_TEXT("emulated_spectrum", asked),
    F_NUMBER("lux", lux),
    F_NUMBER("spread", spread),
    F_WHOLE("teach_readings", teach_readings),
    F_NUMBERS("xy", chromaticity),
    F_NUMBER("cct_K", cct.kelvin),
    F_NUMBER("duv", cct.duv),
    F_FLAG("cct_valid", cct.valid),
    F_TEXT("map", map),
    F_NUMBER("map_scale", map_scale),
    F_SERIES("spot_ratios", spot_ratios, spots),
    F_SERIES("spot_x_m", spot_x_m, spots),
    F_SERIES("spot_z_m", spot_z_m, spots),
    F_NUMBER("proof_lux", proof_lux),
    F_NUMBERS("gains", gains),
    F_NUMBERS("white_taught_relative", white_taught),
    F_NUMBERS("white_reference_cdm2", white_reference),
    F_NUMBERS("white_measured_cdm2", white_measured),
    F_NUMBER("white_luminance_error_percent", white_error_percent),
    F_NUMBERS("black_shown_cdm2", black_shown),
    F_WHOLE("repeats", repeats),
    F_NUMBER("repeat_level", repeat_level),
    F_NUMBER("repeat_colour", repeat_colour),
    F_NUMBER("chart_drift_percent", chart_drift_percent),
    F_WHOLE("white_patch", white_patch),
    F_FLAG("reached", reached),
    F_TEXT("picture", picture),
    F_OBJECT("de00", proof, proof_fields),
    F_LIST("patches", patches, patch_count, patch_fields),
    F_NUMBERS("irradiance_360_830_W_m2_nm", irradiance),
    {0},
};
#undef OWNER

#define OWNER display_report
static const struct field display_fields[] = {
    F_TEXT("measurements", measurements),
    F_TEXT("model", model),
    F_WHOLE("patches", patches),
    F_WHOLE("verification_patches", verified),
    F_OBJECT("fit_de00", fit, summary_fields),
    F_OBJECT("verification_de00", verification, summary_fields),
    F_NUMBER("condition", condition),
    F_NUMBERS("white_cdm2", white),
    F_NUMBERS("black_cdm2", black),
    F_NUMBER("white_drift_percent", white_drift_percent),
    F_NUMBER("warm_up_s", warm_up_s),
    F_NUMBER("warm_up_percent_h", warm_up_percent_h),
    F_NUMBER("settle_s", settle_s),
    F_NUMBERS("residual_de00_Lab", residual),
    {0},
};
#undef OWNER

#define OWNER view_report
static const struct field view_fields[] = {
    F_FLAG("measured", measured),
    F_WHOLE("directions", directions),
    F_WHOLE("places", places),
    F_NUMBER("white_before_de00", before_de00),
    F_NUMBER("white_after_de00", after_de00),
    F_NUMBER("white_before_percent", before_percent),
    F_NUMBER("white_after_percent", after_percent),
    F_NUMBER("place_de00", place_de00),
    F_NUMBER("place_percent", place_percent),
    {0},
};
#undef OWNER

#define OWNER pose_report
static const struct field pose_fields[] = {
    F_NUMBER("tilt_deg", tilt_deg),
    F_NUMBER("tilt_seen_deg", tilt_seen_deg),
    F_NUMBERS("eye_m", eye),
    F_NUMBERS("eye_seen_m", eye_seen),
    F_FLAG("moved_screen", moved_screen),
    F_FLAG("off_axis", off_axis),
    F_NUMBER("off_normal_deg", off_normal_deg),
    F_NUMBERS("white_reference_cdm2", reference),
    F_NUMBERS("white_measured_cdm2", measured),
    F_NUMBER("white_luminance_error_percent", error_percent),
    {0},
};
#undef OWNER

#define OWNER place_report
static const struct field place_fields[] = {
    F_NUMBER("screen_width_m", screen.width_m),
    F_NUMBER("screen_height_m", screen.height_m),
    F_WHOLE("screen_width_px", screen.width_px),
    F_WHOLE("screen_height_px", screen.height_px),
    F_NUMBERS("hinge_m", stand.hinge_m),
    F_NUMBERS("centre_from_hinge_m", stand.centre_from_hinge_m),
    F_NUMBER("tilt_deg", tilt_deg),
    F_NUMBERS("eye_m", eye),
    F_NUMBERS("ceiling_centre_m", centre_m),
    F_NUMBER("ceiling_width_m", width_m),
    F_NUMBER("ceiling_depth_m", depth_m),
    F_NUMBER("reflectance", reflectance),
    F_WHOLE("bits", bits),
    F_FLAG("dither", dither),
    {0},
};
#undef OWNER

#define OWNER chart_report
static const struct field chart_fields[] = {
    F_TEXT("name", name),
    F_NUMBERS("reflectance_360_830", reflectance),
    {0},
};
#undef OWNER

#define OWNER session_facts
const struct field session_fields[] = {
    F_TEXT("booth", booth),
    F_TEXT("started", started),
    F_TEXT("finished", finished),
    F_NUMBER("seconds", seconds),
    F_TEXT("software", software),
    F_TEXT("observer", observer),
    F_TEXT("environment", environment),
    F_TEXT("config", config),
    F_TEXT("material", material),
    F_FLAG("emulated", emulated),
    F_FLAG("truth_emulated", truth_emulated),
    F_OBJECT("place", place, place_fields),
    F_OBJECT("display", display, display_fields),
    F_OBJECT("view", view, view_fields),
    F_LIST("lamps", lamps, lamp_count, lamp_fields),
    F_LIST("poses", poses, pose_count, pose_fields),
    F_LIST("chart", chart, chart_count, chart_fields),
    F_JSON("settings", settings),
    F_JSON("readings", readings),
    {0},
};
#undef OWNER

bool facts_save(const struct session_facts *facts, const char *path, struct error *err)
{
    json_t *all = fields_as_json(session_fields, facts);
    if (all)
        json_object_set_new(all, "kind", json_string(KIND));
    char *text = all ? json_dumps(all, JSON_INDENT(1) | JSON_REAL_PRECISION(9)) : NULL;
    json_decref(all);
    bool fine = text ? whole_file_write(path, text, strlen(text), err)
                     : fail(err, ERROR_DATA, "%s: a fact in it cannot be written", path);
    free(text);
    return fine;
}

bool facts_load(const char *path, struct session_facts *facts, struct error *err)
{
    size_t size;
    json_error_t why;
    char *text = file_read(path, FACTS_BYTES, &size, err);
    if (!text)
        return false;
    json_t *all = json_loadb(text, size, 0, &why);
    free(text);
    const char *kind = json_string_value(json_object_get(all, "kind"));
    *facts = (struct session_facts){0};
    bool fine = true;
    if (!all)
        fine = fail(err, ERROR_DATA, "line %d: %s", why.line, why.text);
    else if (!kind || strcmp(kind, KIND))
        fine = fail(err, ERROR_DATA, "no session that boothcal wrote");
    else
        fine = fields_from_json(session_fields, all, facts, err);
    json_decref(all);
    if (!fine)
        facts_fini(facts);
    return fine || while_doing(err, "%s", path);
}

void facts_fini(struct session_facts *facts)
{
    json_decref(facts->settings);
    json_decref(facts->readings);
    facts->settings = facts->readings = NULL;
}
