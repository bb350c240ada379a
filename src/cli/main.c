#include <ctype.h>
#include <getopt.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/regular.h"
#include "cli/cli.h"

static const char help_text[] =
    "shade: renders scene documents (JSON) into Phong-shaded, color-converted pictures.\n"
    "\n"
    "  shade render SCENE.json -o OUT.png   render a scene into a file\n"
    "  shade explain SCENE.json [-o OUT]    say how a scene would be rendered: what is used and "
    "left\n"
    "                                       out, and why, how far off the picture may be, and\n"
    "                                       what it costs; in words on a terminal, else as JSON\n"
    "  shade compare SCENE.json [-o OUT]    say what each accuracy tier costs, and how far off it\n"
    "                                       is from the exact one, as JSON (default: stdout)\n"
    "  shade analyze SCENE.json [-o OUT]    say what its outputs display: percentiles, "
    "histograms,\n"
    "                                       what is clipped, as JSON (default: stdout)\n"
    "  shade brdf SCENE.json [-o OUT]       say what its materials do with light: f_r, albedo,\n"
    "                                       reciprocity, as JSON (default: stdout); OUT.svg and\n"
    "                                       OUT.png are plots of their lobes\n"
    "  shade link SCENE.json                print the path of the link that holds a scene, for a\n"
    "                                       daemon to draw\n"
    "  shade batch FILE.jsonl -o FOLDER     render each line of a file, a scene or a scene with\n"
    "                                       variants as POST /v1/batch has them, into FOLDER: by\n"
    "                                       the name beside `scene`, or the line's number\n"
    "  shade verify PICTURE SCENE.json      say whether a picture is that of a scene, as JSON: "
    "random\n"
    "                                       pixels are held against the exact tier, in intervals\n"
    "  shade diff A B [-o MAP.png]          say how far two pictures are apart, as JSON: "
    "CIEDE2000\n"
    "                                       and FLIP. A and B are files (png, jpg, webp, tif, "
    "taken\n"
    "                                       for sRGB) or scenes (json); MAP shows FLIP's errors\n"
    "  shade import MODEL -o SCENE.json     make a scene of a model: obj (with its mtl), gltf, "
    "glb, "
    "ply\n"
    "                                       or stl; or of a material of three.js (json)\n"
    "  shade fit PHOTO SCENE.json           find the coefficients of a material from a photo of "
    "its\n"
    "                                       scene, as JSON, with what its light does not tell\n"
    "  shade check SCENE.json...            say what is wrong with scenes; silent if nothing is\n"
    "\n"
    "  -o, --output OUT   where the picture goes. Its suffix (png, jpg, webp, tif, exr, hdr)\n"
    "                     is the format unless the scene names one, which must agree with it.\n"
    "                     A scene with `outputs` wants a directory (OUT/ is made if missing)\n"
    "                     and fills it with NAME.png and so on.\n"
    "      --json         explain as JSON on a terminal, too\n"
    "      --shard I/N    render every Nth line of a batch, from line I + 1 on; I is 0 to N - 1\n"
    "      --resume       leave pictures of a batch alone that are there already\n"
    "      --pixels N     pixels to verify (default: 400)\n"
    "      --seed N       other ones (default: 1)\n"
    "      --tolerance N  codes that jpeg or webp may have lost (default: measured)\n"
    "      --fail-above METRIC=VALUE  exit 1 if a difference is more: deltaE2000, flip (their "
    "means,\n"
    "                     or with .mean .p50 .p95 .p99 .max), alpha; may be given several times\n"
    "      --density N    pixels a degree of sight that FLIP reckons with, 10 to 400 (default: "
    "67)\n"
    "      --phong        give imported materials Phong's model, by the nearest fit\n"
    "      --meshes FOLDER  write the meshes of an imported model there, each under its SHA-256, "
    "for\n"
    "                     PUT /v1/meshes; the scene names them (default: the scene has them)\n"
    "      --object NAME  whose material a fit finds: its `name`, or its number from 0 on; needed\n"
    "                     if objects have several materials\n"
    "      --threads N    threads to render with (default: as processors allow)\n"
    "      --kernel NAME  portable, avx2, avx512 or neon: instructions to render with (default:\n"
    "                     auto, the widest there are); portable ones may round otherwise where\n"
    "                     a picture is not exact, and a budget may take another tier\n"
    "      --ocio FILE    an OpenColorIO configuration (.ocio, .ocioz or ocio://NAME) instead of\n"
    "                     the built-in one; $OCIO and OCIO_* are not looked at\n"
    "      --assets FOLDER  pictures that documents may name: the files of a folder. import "
    "writes\n"
    "                     a model's pictures there, each under its SHA-256; the scene names them\n"
    "                     (default: it has their mean colors)\n"
    "      --materials FILE  materials that `preset` may name beside the built-in ones; may be\n"
    "                     given several times; its path has no blanks\n"
    "  -h, --help         this text\n"
    "  -V, --version      the version\n"
    "\n"
    "SCENE `-` is stdin and OUT `-` is stdout, as PNG unless the scene names a format.\n"
    "Problems go to stderr, one a line: FILE:line:column: for JSON syntax, FILE: /pointer: for\n"
    "the rest, `warning:` before what is only worth a word. A file is replaced when its picture\n"
    "is complete, or not at all. Limits are wide: 268 million pixels, 67 million triangles,\n"
    "a million lights and objects, 1 GiB of JSON, and as much memory as the machine has.\n"
    "\n"
    "Exit status: 0 done; 1 the scene is wrong, a file could not be read or written, or a picture "
    "is\n"
    "not that of the scene, or farther apart than --fail-above says; 2 the command line is "
    "wrong.\n";

#define COMMANDS                                                                                   \
    "render, explain, compare, analyze, brdf, link, batch, verify, diff, import, fit or check"

static int print_and_exit(const char *text) {
    return cli_write_stdout(text, strlen(text)) ? CLI_DONE : CLI_FAILED;
}

static int print_version(void) {
    char text[64];
    snprintf(text, sizeof text, "shade %s\n", shd_version());
    return print_and_exit(text);
}

static bool parse_threads(const char *text, unsigned *out) {
    const unsigned long value = strtoul(text, NULL, 10);
    if (text[strspn(text, "0123456789")] || value < 1 || value > 1024) return false;
    *out = (unsigned)value;
    return true;
}

static bool parse_shard(const char *text, cli_options *options) {
    char *end;
    if (!isdigit((unsigned char)*text)) return false;
    const unsigned long shard = strtoul(text, &end, 10);
    if (*end != '/' || !isdigit((unsigned char)end[1])) return false;
    const unsigned long shards = strtoul(end + 1, &end, 10);
    if (*end || shard >= shards || shards > 1000 * 1000) return false;
    options->shard = shard;
    options->shards = shards;
    return true;
}

static bool add_materials(const char *path, cli_options *options) {
    static char paths[4096];
    const size_t length = strlen(paths), more = strlen(path);
    if (strchr(path, ' ') || length + more + 2 > sizeof paths) return false;
    snprintf(paths + length, sizeof paths - length, "%s%s", length ? " " : "", path);
    options->engine.materials = paths;
    return true;
}

/* What one scene may take here, where the user owns the machine too. */
static shd_limits limits_of_machine(void) {
    long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    return (shd_limits){.pixels = UINT64_C(1) << 28,
                        .samples = UINT64_C(1) << 34,
                        .lights = 1000 * 1000,
                        .objects = 1000 * 1000,
                        .triangles = UINT64_C(1) << 26,
                        .light_samples = UINT64_MAX,
                        .object_lights = UINT64_MAX,
                        .work = UINT64_MAX,
                        .body = UINT64_C(1) << 30,
                        .memory = pages > 0 && page > 0 ? (uint64_t)pages * (uint64_t)page
                                                        : UINT64_C(1) << 32};
}

enum {
    OPTION_THREADS = 256,
    OPTION_JSON,
    OPTION_KERNEL,
    OPTION_OCIO,
    OPTION_ASSETS,
    OPTION_MATERIALS,
    OPTION_SHARD,
    OPTION_RESUME,
    OPTION_PIXELS,
    OPTION_SEED,
    OPTION_TOLERANCE,
    OPTION_FAIL_ABOVE,
    OPTION_DENSITY,
    OPTION_PHONG,
    OPTION_MESHES,
    OPTION_OBJECT
};

/* Those of diff. As take_option. */
static int take_comparison(int option, const char *value, cli_options *options) {
    char *end;
    options->compares = true;
    if (option == OPTION_FAIL_ABOVE) {
        if (cli_take_above(value, options)) return -1;
        return cli_usage("--fail-above wants a metric and a number, such as flip.p99=0.1, not '%s'",
                         value);
    }
    options->density = strtod(value, &end);
    if (isdigit((unsigned char)*value) && !*end && options->density >= 10 &&
        options->density <= 400)
        return -1;
    return cli_usage("--density wants a number from 10 to 400, not '%s'", value);
}

/* Those of verify. As take_option. */
static int take_number(int option, const char *value, cli_options *options) {
    char *end;
    const unsigned long long number = strtoull(value, &end, 10);
    const bool whole = isdigit((unsigned char)*value) && !*end;
    options->checks_pixels = true;
    if (option == OPTION_PIXELS) {
        if (!whole || number < 1 || number > UINT64_C(1) << 40)
            return cli_usage("--pixels wants a number from 1 on, not '%s'", value);
        options->verify.pixels = (size_t)number;
    } else if (option == OPTION_SEED) {
        if (!whole) return cli_usage("--seed wants a number from 0 on, not '%s'", value);
        options->verify.seed = number;
    } else {
        if (!whole || number > 65535)
            return cli_usage("--tolerance wants a number from 0 to 65535, not '%s'", value);
        options->verify.tolerance = (double)number;
    }
    return -1;
}

/* Where an option's value is kept as it is. NULL: it is another one. */
static const char **find_text(int option, cli_options *options) {
    switch (option) {
    case OPTION_KERNEL:
        return &options->engine.kernel;
    case OPTION_OCIO:
        return &options->engine.ocio_config;
    case OPTION_ASSETS:
        return &options->engine.assets;
    case OPTION_OBJECT:
        return &options->object;
    default:
        return NULL;
    }
}

/* Takes one option and its value. Returns the exit status, or -1: go on. */
static int take_option(int option, const char *value, cli_options *options) {
    const char **text = find_text(option, options);
    if (text) {
        *text = value;
        return -1;
    }
    switch (option) {
    case 'o':
        if (options->output) return cli_usage("-o is given twice");
        options->output = value;
        return -1;
    case OPTION_THREADS:
        if (parse_threads(value, &options->engine.threads)) return -1;
        return cli_usage("--threads wants a number from 1 to 1024, not '%s'", value);
    case OPTION_JSON:
        options->json = true;
        return -1;
    case OPTION_MATERIALS:
        if (add_materials(value, options)) return -1;
        return cli_usage("--materials: the paths are too long, or one has blanks");
    case OPTION_SHARD:
        if (parse_shard(value, options)) return -1;
        return cli_usage("--shard wants I/N with I from 0 to N - 1, not '%s'", value);
    case OPTION_RESUME:
        options->resume = true;
        return -1;
    case OPTION_PIXELS:
    case OPTION_SEED:
    case OPTION_TOLERANCE:
        return take_number(option, value, options);
    case OPTION_PHONG:
        options->phong = true;
        return -1;
    case OPTION_MESHES:
        if (!*value) return cli_usage("--meshes is empty");
        options->meshes = value;
        return -1;
    case OPTION_FAIL_ABOVE:
    case OPTION_DENSITY:
        return take_comparison(option, value, options);
    case 'h':
        return print_and_exit(help_text);
    case 'V':
        return print_version();
    default: /* getopt has said what is wrong */
        return cli_hint();
    }
}

/* Options may stand anywhere: the leading '-' of the short ones asks getopt for that, whatever
 * POSIXLY_CORRECT says. Moves the operands to the front of argv, which has been read by then.
 * Returns the exit status, or -1: go on. */
static int read_options(int argc, char **argv, cli_options *options, size_t *count) {
    static const struct option long_options[] = {
        {"output", required_argument, NULL, 'o'},
        {"json", no_argument, NULL, OPTION_JSON},
        {"threads", required_argument, NULL, OPTION_THREADS},
        {"kernel", required_argument, NULL, OPTION_KERNEL},
        {"ocio", required_argument, NULL, OPTION_OCIO},
        {"assets", required_argument, NULL, OPTION_ASSETS},
        {"materials", required_argument, NULL, OPTION_MATERIALS},
        {"shard", required_argument, NULL, OPTION_SHARD},
        {"resume", no_argument, NULL, OPTION_RESUME},
        {"pixels", required_argument, NULL, OPTION_PIXELS},
        {"seed", required_argument, NULL, OPTION_SEED},
        {"tolerance", required_argument, NULL, OPTION_TOLERANCE},
        {"fail-above", required_argument, NULL, OPTION_FAIL_ABOVE},
        {"density", required_argument, NULL, OPTION_DENSITY},
        {"phong", no_argument, NULL, OPTION_PHONG},
        {"meshes", required_argument, NULL, OPTION_MESHES},
        {"object", required_argument, NULL, OPTION_OBJECT},
        {"help", no_argument, NULL, 'h'},
        {"version", no_argument, NULL, 'V'},
        {NULL, 0, NULL, 0},
    };
    char **operands = argv + 1;
    int option, result = -1;
    while (result < 0 && (option = getopt_long(argc, argv, "-o:hV", long_options, NULL)) != -1) {
        if (option == 1)
            operands[(*count)++] = optarg;
        else
            result = take_option(option, optarg, options);
    }
    if (result >= 0) return result;
    for (int i = optind; i < argc; i++) operands[(*count)++] = argv[i]; /* behind "--" */
    return -1;
}

/* Those that write to stdout, or files of their own. -1: it is none of them. */
static int run_other(const char *name, const char *const *scenes, size_t count,
                     const cli_options *options) {
    if (!strcmp(name, "verify")) {
        if (options->output) return cli_usage("verify writes to stdout: -o has no place here");
        if (count != 2) return cli_usage("verify wants a picture and a scene, not %zu", count);
        return cli_verify(scenes[0], scenes[1], options);
    }
    if (!strcmp(name, "diff")) {
        if (count != 2) return cli_usage("diff wants two pictures or scenes, not %zu", count);
        if (!strcmp(scenes[0], "-") && !strcmp(scenes[1], "-"))
            return cli_usage("stdin is one scene, not two");
        return cli_diff(scenes, options);
    }
    if (!strcmp(name, "fit")) {
        if (options->output) return cli_usage("fit writes to stdout: -o has no place here");
        if (count != 2) return cli_usage("fit wants a photo and a scene, not %zu", count);
        return cli_fit(scenes[0], scenes[1], options);
    }
    if (!strcmp(name, "link")) {
        if (options->output) return cli_usage("link writes to stdout: -o has no place here");
        if (count != 1) return cli_usage("link wants one scene, not %zu", count);
        return cli_link(scenes[0], &options->engine);
    }
    if (!strcmp(name, "import")) {
        if (!options->output || !*options->output) return cli_usage("import wants -o SCENE.json");
        if (count != 1) return cli_usage("import wants one model, not %zu", count);
        return cli_import(scenes[0], options);
    }
    if (!strcmp(name, "batch")) {
        if (!options->output || !*options->output) return cli_usage("batch wants -o FOLDER");
        if (count != 1) return cli_usage("batch wants one file, not %zu", count);
        return cli_batch(scenes[0], options);
    }
    return -1;
}

static int run_command(const char *name, const char *const *scenes, size_t count,
                       const cli_options *options) {
    static const char *const names[] = {"render", "explain", "compare", "analyze", "brdf", "check"};
    enum cli_command command = 0;
    while (command < CLI_COMMANDS && strcmp(name, names[command])) command++;
    const bool checks = command == CLI_CHECK;
    if (options->json && command != CLI_EXPLAIN)
        return cli_usage("--json is for explain, which has words as well");
    if ((options->shards || options->resume) && strcmp(name, "batch"))
        return cli_usage("--shard and --resume are for batch");
    if (options->checks_pixels && strcmp(name, "verify"))
        return cli_usage("--pixels, --seed and --tolerance are for verify");
    if (options->compares && strcmp(name, "diff"))
        return cli_usage("--fail-above and --density are for diff");
    if ((options->phong || options->meshes) && strcmp(name, "import"))
        return cli_usage("--phong and --meshes are for import");
    if (options->object && strcmp(name, "fit")) return cli_usage("--object is for fit");
    const int other = run_other(name, scenes, count, options);
    if (other >= 0) return other;
    if (command == CLI_COMMANDS) return cli_usage("unknown command '%s': " COMMANDS, name);
    if (checks && count == 0) return cli_usage("check wants a scene");
    if (checks && options->output) return cli_usage("check writes nothing: -o has no place here");
    if (!checks && count != 1) return cli_usage("%s wants one scene, not %zu", name, count);
    if (command == CLI_RENDER && !options->output) return cli_usage("render wants -o OUT");
    return cli_run(command, scenes, count, options);
}

int main(int argc, char **argv) {
    if (!shd_occupy_closed_streams()) return CLI_FAILED;
    /* A reader that went away, and a file that may not grow, become write errors with a message. */
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN);

    /* Of one scene nothing is kept but what is built in, for objects that have it, too. */
    cli_options options = {.engine = {.limits = limits_of_machine(), .mesh_store = 256 << 20},
                           .verify = {400, 1, -1}};
    size_t count = 0;
    const int result = read_options(argc, argv, &options, &count);
    if (result >= 0) return result;
    if (count == 0) return cli_usage("no command: " COMMANDS);
    return run_command(argv[1], (const char *const *)argv + 2, count - 1, &options);
}
