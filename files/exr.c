// SPDX-License-Identifier: Apache-2.0
#include "files/exr.h"

#include <errno.h>
#include <math.h>
#include <openexr.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "files/text.h"
#include "files/write.h"

enum { SIDE_MOST = 16384, NAME_MOST = 31 };

// One image fills memory before it fills the range of its sides.
static const size_t BYTES_MOST = (size_t)4 << 30;

// What the library reads from or writes to, and its last complaint.
struct stream {
    const char *path;
    const char *bytes; // reading
    size_t size;
    FILE *out; // writing
    char complaint[200];
};

void exr_fini(struct exr *image)
{
    free(image->pixels);
    *image = (struct exr){0};
}

static bool check_size(int width, int height, int channels, struct error *err)
{
    if (width < 1 || width > SIDE_MOST || height < 1 || height > SIDE_MOST)
        return fail(err, ERROR_RANGE, "image of %d x %d pixels; allowed: 1..%d each", width, height,
                    SIDE_MOST);
    if (channels < 1 || channels > EXR_CHANNELS_MOST)
        return fail(err, ERROR_RANGE, "image of %d channels; allowed: 1..%d", channels,
                    EXR_CHANNELS_MOST);
    if ((size_t)width * height * channels * sizeof(float) > BYTES_MOST)
        return fail(err, ERROR_RANGE, "image of %d x %d pixels and %d channels is over 4 GiB",
                    width, height, channels);
    return true;
}

bool exr_init(struct exr *image, int width, int height, int channels, struct error *err)
{
    *image = (struct exr){0};
    if (!check_size(width, height, channels, err))
        return false;
    float *pixels = calloc((size_t)width * height * channels, sizeof *pixels);
    if (!pixels)
        return fail_errno(err, "image of %d x %d pixels", width, height);
    image->width = width;
    image->height = height;
    image->channels = channels;
    image->pixels = pixels;
    return true;
}

int exr_channel(const struct exr *image, const char *name)
{
    for (int c = 0; c < image->channels; c++)
        if (!strcmp(image->names[c], name))
            return c;
    return -1;
}

bool exr_number(const struct exr *image, const char *name, double *value)
{
    for (int i = 0; i < EXR_ATTRIBUTES_MOST && *image->numbers[i].name; i++) {
        if (strcmp(image->numbers[i].name, name))
            continue;
        *value = image->numbers[i].value;
        return true;
    }
    return false;
}

bool exr_set_number(struct exr *image, const char *name, double value)
{
    int i = 0;
    while (i < EXR_ATTRIBUTES_MOST && *image->numbers[i].name &&
           strcmp(image->numbers[i].name, name))
        i++;
    if (i == EXR_ATTRIBUTES_MOST || strlen(name) >= sizeof image->numbers[i].name)
        return false;
    strcpy(image->numbers[i].name, name);
    image->numbers[i].value = value;
    return true;
}

bool exr_set_text(struct exr *image, const char *name, const char *value)
{
    int i = 0;
    while (i < EXR_ATTRIBUTES_MOST && *image->texts[i].name && strcmp(image->texts[i].name, name))
        i++;
    if (i == EXR_ATTRIBUTES_MOST || strlen(name) >= sizeof image->texts[i].name ||
        strlen(value) >= sizeof image->texts[i].value)
        return false;
    strcpy(image->texts[i].name, name);
    strcpy(image->texts[i].value, value);
    return true;
}

static void complain(exr_const_context_t context, exr_result_t code, const char *message)
{
    void *user = NULL;
    (void)code;
    if (!context || exr_get_user_data(context, &user) || !user)
        return;
    struct stream *stream = user;
    char shown[sizeof stream->complaint];
    size_t i = 0;
    for (; message[i] && i < sizeof shown - 1; i++)
        shown[i] = message[i] >= ' ' && message[i] <= '~' ? message[i] : '?';
    shown[i] = 0;
    strcpy(stream->complaint, shown);
}

static int64_t read_bytes(exr_const_context_t context, void *user, void *buffer, uint64_t size,
                          uint64_t offset, exr_stream_error_func_ptr_t report)
{
    const struct stream *stream = user;
    (void)context, (void)report;
    if (offset >= stream->size)
        return 0;
    uint64_t left = stream->size - offset;
    size = size < left ? size : left;
    memcpy(buffer, stream->bytes + offset, size);
    return size;
}

static int64_t count_bytes(exr_const_context_t context, void *user)
{
    (void)context;
    return ((const struct stream *)user)->size;
}

static int64_t write_bytes(exr_const_context_t context, void *user, const void *buffer,
                           uint64_t size, uint64_t offset, exr_stream_error_func_ptr_t report)
{
    const struct stream *stream = user;
    for (uint64_t done = 0; done < size;) {
        ssize_t n =
            pwrite(fileno(stream->out), (const char *)buffer + done, size - done, offset + done);
        if (n > 0)
            done += n;
        else if (n == 0 || errno != EINTR)
            return report(context, EXR_ERR_WRITE_IO, "%s", strerror(errno)), -1;
    }
    return size;
}

static exr_context_initializer_t initializer(struct stream *stream)
{
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = complain;
    init.user_data = stream;
    init.read_fn = read_bytes;
    init.size_fn = count_bytes;
    init.write_fn = write_bytes;
    init.max_image_width = init.max_image_height = SIDE_MOST;
    return init;
}

static bool malformed(const struct stream *stream, struct error *err)
{
    return fail(err, ERROR_DATA, "%s: is not a sound OpenEXR image%s%s", stream->path,
                *stream->complaint ? ": " : "", stream->complaint);
}

static const char *storage_name(exr_storage_t storage)
{
    switch (storage) {
    case EXR_STORAGE_SCANLINE:
        return "scan-line";
    case EXR_STORAGE_TILED:
        return "tiled";
    case EXR_STORAGE_DEEP_SCANLINE:
    case EXR_STORAGE_DEEP_TILED:
        return "deep";
    case EXR_STORAGE_LAST_TYPE:
        break;
    }
    return "unknown";
}

static const char *compression_name(exr_compression_t compression)
{
    switch (compression) {
    case EXR_COMPRESSION_NONE:
    case EXR_COMPRESSION_RLE:
    case EXR_COMPRESSION_ZIPS:
    case EXR_COMPRESSION_ZIP:
    case EXR_COMPRESSION_PIZ:
        return NULL;
    case EXR_COMPRESSION_PXR24:
        return "PXR24";
    case EXR_COMPRESSION_B44:
        return "B44";
    case EXR_COMPRESSION_B44A:
        return "B44A";
    case EXR_COMPRESSION_DWAA:
        return "DWAA";
    case EXR_COMPRESSION_DWAB:
        return "DWAB";
    case EXR_COMPRESSION_LAST_TYPE:
        break;
    }
    return "unknown";
}

static bool check_kind(exr_context_t context, const struct stream *stream, struct error *err)
{
    int parts;
    exr_storage_t storage;
    exr_compression_t compression;
    if (exr_get_count(context, &parts) || exr_get_storage(context, 0, &storage) ||
        exr_get_compression(context, 0, &compression))
        return malformed(stream, err);
    if (parts != 1)
        return fail(err, ERROR_DATA, "%s: has %d parts; allowed: 1", stream->path, parts);
    if (storage != EXR_STORAGE_SCANLINE)
        return fail(err, ERROR_DATA, "%s: storage is %s; allowed: scan-line", stream->path,
                    storage_name(storage));
    const char *lossy = compression_name(compression);
    if (lossy)
        return fail(err, ERROR_DATA, "%s: compression is %s; allowed: NONE, RLE, ZIPS, ZIP, PIZ",
                    stream->path, lossy);
    return true;
}

static bool is_listed_before(const exr_attr_chlist_t *list, int index)
{
    for (int c = 0; c < index; c++)
        if (!strcmp(list->entries[c].name.str, list->entries[index].name.str))
            return true;
    return false;
}

static bool check_channels(const exr_attr_chlist_t *list, const struct stream *stream,
                           struct error *err)
{
    for (int c = 0; c < list->num_channels; c++) {
        const exr_attr_chlist_entry_t *entry = &list->entries[c];
        char shown[TEXT_SHOWN];
        text_shown(shown, entry->name.str, entry->name.length);
        if (entry->name.length < 1 || entry->name.length > NAME_MOST || is_listed_before(list, c))
            return fail(err, ERROR_DATA, "%s: channel name \"%s\"; allowed: 1..%d bytes, each once",
                        stream->path, shown, NAME_MOST);
        if (entry->pixel_type == EXR_PIXEL_UINT || entry->x_sampling != 1 || entry->y_sampling != 1)
            return fail(err, ERROR_DATA, "%s: channel %s; allowed: float or half at every pixel",
                        stream->path, shown);
    }
    return true;
}

static void take_attributes(exr_context_t context, struct exr *image)
{
    int32_t count = 0;
    exr_get_attribute_count(context, 0, &count);
    for (int i = 0; i < count; i++) {
        const exr_attribute_t *a;
        if (exr_get_attribute_by_index(context, 0, EXR_ATTR_LIST_FILE_ORDER, i, &a))
            continue;
        bool structural = !strcmp(a->name, "name") || !strcmp(a->name, "type");
        if (structural)
            continue;
        if (a->type == EXR_ATTR_DOUBLE)
            exr_set_number(image, a->name, a->d);
        if (a->type == EXR_ATTR_STRING && a->string->length < (int)sizeof image->texts[0].value) {
            char value[sizeof image->texts[0].value];
            snprintf(value, sizeof value, "%.*s", a->string->length, a->string->str);
            exr_set_text(image, a->name, value);
        }
    }
}

// Looks at every chunk before pixels are allocated, so that a header that
// promises more than the file holds costs nothing. Deflate packs at most
// 1032:1, run lengths 64:1.
static bool check_chunks(exr_context_t context, int first_line, int width, int height)
{
    exr_chunk_info_t chunk;
    for (int row = 0; row < height; row += chunk.height) {
        if (exr_read_scanline_chunk_info(context, 0, first_line + row, &chunk))
            return false;
        if (chunk.start_y != first_line + row || chunk.height < 1 || chunk.height > height - row ||
            chunk.width != width)
            return false;
        if (chunk.compression != EXR_COMPRESSION_PIZ &&
            chunk.unpacked_size > 1100 * (chunk.packed_size + 16))
            return false;
    }
    return true;
}

static bool take_header(exr_context_t context, struct stream *stream, struct exr *image,
                        int *first_line, struct error *err)
{
    exr_attr_box2i_t window;
    const exr_attr_chlist_t *list;
    if (exr_get_data_window(context, 0, &window) || exr_get_channels(context, 0, &list))
        return malformed(stream, err);
    int64_t width = (int64_t)window.max.x - window.min.x + 1;
    int64_t height = (int64_t)window.max.y - window.min.y + 1;
    bool sane = width >= 1 && width <= SIDE_MOST && height >= 1 && height <= SIDE_MOST;
    if (!check_size(sane ? width : 0, sane ? height : 0, list->num_channels, err))
        return while_doing(err, "%s", stream->path);
    if (!check_channels(list, stream, err))
        return false;
    *first_line = window.min.y;
    if (!check_chunks(context, window.min.y, width, height))
        return malformed(stream, err);
    if (!exr_init(image, width, height, list->num_channels, err))
        return while_doing(err, "%s", stream->path);
    for (int c = 0; c < image->channels; c++)
        snprintf(image->names[c], sizeof image->names[c], "%s", list->entries[c].name.str);
    take_attributes(context, image);
    return true;
}

// Aims every channel of a decoding or encoding pipeline at its plane; the
// library sorts channels by name.
static void aim(exr_coding_channel_info_t *channels, int count, const struct exr *image, int row)
{
    size_t plane = (size_t)image->width * image->height;
    for (int i = 0; i < count; i++) {
        exr_coding_channel_info_t *channel = &channels[i];
        int c = exr_channel(image, channel->channel_name);
        channel->user_bytes_per_element = sizeof(float);
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_pixel_stride = sizeof(float);
        channel->user_line_stride = image->width * sizeof(float);
        channel->decode_to_ptr =
            c < 0 ? NULL : (uint8_t *)(image->pixels + c * plane + (size_t)row * image->width);
    }
}

static bool decode(exr_context_t context, exr_decode_pipeline_t *pipeline, struct exr *image,
                   int first_line)
{
    exr_chunk_info_t chunk;
    for (int row = 0; row < image->height; row += chunk.height) {
        if (exr_read_scanline_chunk_info(context, 0, first_line + row, &chunk))
            return false;
        if (row ? exr_decoding_update(context, 0, &chunk, pipeline)
                : exr_decoding_initialize(context, 0, &chunk, pipeline))
            return false;
        aim(pipeline->channels, pipeline->channel_count, image, row);
        if (!row && exr_decoding_choose_default_routines(context, 0, pipeline))
            return false;
        if (exr_decoding_run(context, 0, pipeline))
            return false;
    }
    return true;
}

static bool check_finite(const char *path, const struct exr *image, struct error *err)
{
    const float *value = image->pixels;
    for (int c = 0; c < image->channels; c++)
        for (int y = 0; y < image->height; y++)
            for (int x = 0; x < image->width; x++, value++)
                if (!isfinite(*value))
                    return fail(err, ERROR_DATA,
                                "%s: channel %s, x %d, y %d: %s; allowed: a finite number", path,
                                image->names[c], x, y, isnan(*value) ? "nan" : "inf");
    return true;
}

static bool load(struct stream *stream, struct exr *image, struct error *err)
{
    exr_context_t context;
    exr_context_initializer_t init = initializer(stream);
    if (exr_start_read(&context, stream->path, &init))
        return malformed(stream, err);
    exr_decode_pipeline_t pipeline = EXR_DECODE_PIPELINE_INITIALIZER;
    int first_line = 0;
    bool ok =
        check_kind(context, stream, err) && take_header(context, stream, image, &first_line, err);
    if (ok && !decode(context, &pipeline, image, first_line))
        ok = malformed(stream, err);
    exr_decoding_destroy(context, &pipeline);
    exr_finish(&context);
    return ok && check_finite(stream->path, image, err);
}

bool exr_load(const char *path, struct exr *image, struct error *err)
{
    *image = (struct exr){0};
    struct stream stream = {.path = path};
    char *bytes = file_read(path, BYTES_MOST, &stream.size, err);
    stream.bytes = bytes;
    bool ok = bytes && load(&stream, image, err);
    free(bytes);
    if (!ok)
        exr_fini(image);
    return ok;
}

static bool describe(exr_context_t context, const struct exr *image)
{
    int part;
    if (exr_add_part(context, NULL, EXR_STORAGE_SCANLINE, &part) ||
        exr_initialize_required_attr_simple(context, part, image->width, image->height,
                                            EXR_COMPRESSION_ZIP) ||
        exr_set_longname_support(context, 1))
        return false;
    for (int c = 0; c < image->channels; c++)
        if (exr_add_channel(context, part, image->names[c], EXR_PIXEL_FLOAT,
                            EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1))
            return false;
    for (int i = 0; i < EXR_ATTRIBUTES_MOST && *image->numbers[i].name; i++)
        if (exr_attr_set_double(context, part, image->numbers[i].name, image->numbers[i].value))
            return false;
    for (int i = 0; i < EXR_ATTRIBUTES_MOST && *image->texts[i].name; i++)
        if (exr_attr_set_string(context, part, image->texts[i].name, image->texts[i].value))
            return false;
    return !exr_write_header(context);
}

static bool encode(exr_context_t context, exr_encode_pipeline_t *pipeline, const struct exr *image)
{
    exr_chunk_info_t chunk;
    for (int row = 0; row < image->height; row += chunk.height) {
        if (exr_write_scanline_chunk_info(context, 0, row, &chunk))
            return false;
        if (row ? exr_encoding_update(context, 0, &chunk, pipeline)
                : exr_encoding_initialize(context, 0, &chunk, pipeline))
            return false;
        aim(pipeline->channels, pipeline->channel_count, image, row);
        if (!row && exr_encoding_choose_default_routines(context, 0, pipeline))
            return false;
        if (exr_encoding_run(context, 0, pipeline))
            return false;
    }
    return true;
}

static bool save(struct stream *stream, const struct exr *image, struct error *err)
{
    exr_context_t context;
    exr_context_initializer_t init = initializer(stream);
    exr_encode_pipeline_t pipeline = EXR_ENCODE_PIPELINE_INITIALIZER;
    bool ok = !exr_start_write(&context, stream->path, EXR_WRITE_FILE_DIRECTLY, &init);
    if (ok) {
        ok = describe(context, image) && encode(context, &pipeline, image);
        exr_encoding_destroy(context, &pipeline);
        ok = !exr_finish(&context) && ok;
    }
    return ok || fail(err, ERROR_SYSTEM, "%s: writing failed, the file is as it was: %s",
                      stream->path, stream->complaint);
}

static bool check_names(const char *path, const struct exr *image, struct error *err)
{
    for (int c = 0; c < image->channels; c++)
        if (!*image->names[c] || exr_channel(image, image->names[c]) != c)
            return fail(err, ERROR_RANGE,
                        "%s: channel %d is named \"%s\"; allowed: 1..%d bytes, each once", path, c,
                        image->names[c], NAME_MOST);
    return true;
}

bool exr_save(const char *path, const struct exr *image, struct error *err)
{
    struct whole_file file;
    if (!check_size(image->width, image->height, image->channels, err))
        return while_doing(err, "%s", path);
    if (!check_names(path, image, err) || !check_finite(path, image, err) ||
        !whole_file_begin(&file, path, err))
        return false;
    struct stream stream = {.path = path, .out = file.stream};
    if (save(&stream, image, err))
        return whole_file_commit(&file, err);
    whole_file_abandon(&file);
    return false;
}
