// SPDX-License-Identifier: Apache-2.0
#include <string.h>

#include "calibration/proof.h"
#include "calibration/report.h"

static void row(FILE *out, const char *what, const struct summary *s)
{
    fprintf(out, "  %-36s %6.2f %6.2f %6.2f %6.2f  %3d\n", what, s->mean, s->std, s->p90, s->max,
            s->n);
}

static void published_line(FILE *out, const char *what, const double v[4])
{
    fprintf(out, "  %-36s %6.1f %6.1f %6.1f %6.1f\n", what, v[0], v[1], v[2], v[3]);
}

static void published(FILE *out, const char *lamp)
{
    for (int i = 0; i < 3; i++) {
        const struct published_row *r = &published_table[i];
        if (strcmp(r->lamp, lamp))
            continue;
        published_line(out, "published: six-channel simulation", r->simulation);
        published_line(out, "published: from screen, all", r->screen);
        if (r->in_gamut[3] > 0)
            published_line(out, "published: from screen, in gamut", r->in_gamut);
    }
}

static void lamp_table(FILE *out, const struct lamp_report *l)
{
    fprintf(out, "\nLamp %s: x %.4f y %.4f", l->name, l->chromaticity.x, l->chromaticity.y);
    if (l->cct.valid)
        fprintf(out, ", CCT %.0f K, Duv %+.4f", l->cct.kelvin, l->cct.duv);
    fprintf(out, ", white %.1f cd/m2 (error %+.2f %%)\n", l->white_reference.Y,
            l->white_error_percent);
    fprintf(out, "  %-36s %6s %6s %6s %6s  %3s\n", "dE00", "mean", "std", "90th", "max", "n");
    row(out, "band simulation, as published", &l->proof.simulation);
    row(out, "from screen, as published, in gamut", &l->proof.published_in_gamut);
    row(out, "from screen, as published, all", &l->proof.published);
    row(out, "from screen, absolute, in gamut", &l->proof.absolute_in_gamut);
    row(out, "from screen, absolute, all", &l->proof.absolute);
    published(out, l->name);
    fprintf(out, "  targets (in gamut, as published: mean %.1f, max %.1f; white %.0f %%): %s\n",
            PROOF_MEAN_MOST, PROOF_MAX_MOST, PROOF_WHITE_PERCENT_MOST,
            l->reached ? "reached" : "MISSED");
}

void report_as_text(const struct session_facts *f, FILE *out)
{
    const struct display_report *d = &f->display;
    fprintf(out, "%s, %s, observer %s%s\n", f->booth, f->software, f->observer,
            f->emulated ? ", EMULATED instruments" : "");
    fprintf(out,
            "Display model: %d patches fitted, dE00 mean %.2f max %.2f; %d others, mean %.2f max "
            "%.2f\n",
            d->patches, d->fit.mean, d->fit.max, d->verified, d->verification.mean,
            d->verification.max);
    if (f->view.measured)
        fprintf(
            out,
            "Display by direction: %d directions, white up to %+.1f %% (dE00 %.2f), corrected to "
            "%+.2f %% (%.2f); by place: up to %+.1f %% (%.2f)\n",
            f->view.directions, f->view.before_percent, f->view.before_de00, f->view.after_percent,
            f->view.after_de00, f->view.place_percent, f->view.place_de00);
    for (int i = 0; i < f->lamp_count; i++)
        lamp_table(out, &f->lamps[i]);
    fprintf(out, "\nMoved screen and head\n");
    for (int i = 0; i < f->pose_count; i++) {
        const struct pose_report *p = &f->poses[i];
        fprintf(out, "  tilt %5.1f (seen %6.2f) deg, eye off by %4.1f mm", p->tilt_deg,
                p->tilt_seen_deg, 1000 * vec3_length(vec3_sub(p->eye, p->eye_seen)));
        if (p->off_axis)
            fprintf(out, ", %.0f deg off the normal", p->off_normal_deg);
        if (p->moved_screen)
            fprintf(out, ", white %.1f cd/m2, shown %.1f (%+.2f %%)", p->reference.Y, p->measured.Y,
                    p->error_percent);
        fprintf(out, "\n");
    }
}
