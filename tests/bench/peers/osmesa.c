/* Mesa's llvmpipe: times a full-screen triangle drawn by a fragment shader into an 8-bit sRGB
 * picture and read back as RGBA8: osmesa ROUNDS SIZE SHADER UNIFORMS PICTURE.ppm UNIFORMS has a
 * line for each: its components (1 or 3), name, elements, and their values. LP_NUM_THREADS tells
 * llvmpipe its threads. Prints JSON: "wall" and "cpu" (of the process) seconds of each round, and
 * the "renderer". */
#include <GL/gl.h>
#include <GL/glext.h>
#include <GL/osmesa.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* glext.h has no types for what is older than it. */
typedef void(APIENTRY *enable_proc)(GLenum);
typedef void(APIENTRY *viewport_proc)(GLint, GLint, GLsizei, GLsizei);
typedef void(APIENTRY *draw_arrays_proc)(GLenum, GLint, GLsizei);
typedef void(APIENTRY *read_pixels_proc)(GLint, GLint, GLsizei, GLsizei, GLenum, GLenum, void *);
typedef const GLubyte *(APIENTRY *get_string_proc)(GLenum);

/* Nothing but OSMesa is linked: all functions of OpenGL are looked up. */
#define FUNCTIONS(X)                                                                               \
    X(PFNGLCREATESHADERPROC, create_shader, "glCreateShader")                                      \
    X(PFNGLSHADERSOURCEPROC, shader_source, "glShaderSource")                                      \
    X(PFNGLCOMPILESHADERPROC, compile_shader, "glCompileShader")                                   \
    X(PFNGLCREATEPROGRAMPROC, create_program, "glCreateProgram")                                   \
    X(PFNGLATTACHSHADERPROC, attach_shader, "glAttachShader")                                      \
    X(PFNGLLINKPROGRAMPROC, link_program, "glLinkProgram")                                         \
    X(PFNGLUSEPROGRAMPROC, use_program, "glUseProgram")                                            \
    X(PFNGLGETPROGRAMIVPROC, get_program, "glGetProgramiv")                                        \
    X(PFNGLGETPROGRAMINFOLOGPROC, get_program_log, "glGetProgramInfoLog")                          \
    X(PFNGLGETUNIFORMLOCATIONPROC, get_uniform, "glGetUniformLocation")                            \
    X(PFNGLUNIFORM1FVPROC, set_floats, "glUniform1fv")                                             \
    X(PFNGLUNIFORM3FVPROC, set_vectors, "glUniform3fv")                                            \
    X(PFNGLGENVERTEXARRAYSPROC, gen_vertex_arrays, "glGenVertexArrays")                            \
    X(PFNGLBINDVERTEXARRAYPROC, bind_vertex_array, "glBindVertexArray")                            \
    X(PFNGLGENFRAMEBUFFERSPROC, gen_framebuffers, "glGenFramebuffers")                             \
    X(PFNGLBINDFRAMEBUFFERPROC, bind_framebuffer, "glBindFramebuffer")                             \
    X(PFNGLGENRENDERBUFFERSPROC, gen_renderbuffers, "glGenRenderbuffers")                          \
    X(PFNGLBINDRENDERBUFFERPROC, bind_renderbuffer, "glBindRenderbuffer")                          \
    X(PFNGLRENDERBUFFERSTORAGEPROC, renderbuffer_storage, "glRenderbufferStorage")                 \
    X(PFNGLFRAMEBUFFERRENDERBUFFERPROC, framebuffer_renderbuffer, "glFramebufferRenderbuffer")     \
    X(PFNGLCHECKFRAMEBUFFERSTATUSPROC, check_framebuffer, "glCheckFramebufferStatus")              \
    X(enable_proc, enable, "glEnable")                                                             \
    X(viewport_proc, viewport, "glViewport")                                                       \
    X(draw_arrays_proc, draw_arrays, "glDrawArrays")                                               \
    X(read_pixels_proc, read_pixels, "glReadPixels")                                               \
    X(get_string_proc, get_string, "glGetString")

#define DECLARE(type, name, text) static type name;
FUNCTIONS(DECLARE)

static void quit(const char *what, const char *more) {
    fprintf(stderr, "osmesa: %s %s\n", what, more);
    exit(1);
}

static void look_up(const char *name, void *out) {
    OSMESAproc found = OSMesaGetProcAddress(name);
    if (!found) quit("no", name);
    memcpy(out, &found, sizeof found);
}

static void look_up_all(void) {
#define LOOK_UP(type, name, text) look_up(text, &name);
    FUNCTIONS(LOOK_UP)
}

static char *read_file(const char *path) {
    FILE *file = fopen(path, "rb");
    char *text = calloc(1, 1 << 20);
    if (!file || !text || !fread(text, 1, (1 << 20) - 1, file)) quit("cannot read", path);
    fclose(file);
    return text;
}

static GLuint compiled(GLenum kind, const char *text) {
    GLuint shader = create_shader(kind);
    shader_source(shader, 1, &text, NULL);
    compile_shader(shader);
    return shader;
}

static GLuint make_program(const char *fragment) {
    static const char vertex[] =
        "#version 330 core\n"
        "void main() {\n"
        "  vec2 corner = vec2((gl_VertexID & 1) * 4 - 1, (gl_VertexID & 2) * 2 - 1);\n"
        "  gl_Position = vec4(corner, 0.0, 1.0);\n"
        "}\n";
    GLuint program = create_program(), vertices;
    attach_shader(program, compiled(GL_VERTEX_SHADER, vertex));
    attach_shader(program, compiled(GL_FRAGMENT_SHADER, fragment));
    link_program(program);
    GLint linked;
    get_program(program, GL_LINK_STATUS, &linked);
    char log[4096] = "";
    get_program_log(program, sizeof log, NULL, log);
    if (!linked) quit("the program does not link:", log);
    use_program(program);
    gen_vertex_arrays(1, &vertices);
    bind_vertex_array(vertices);
    return program;
}

static void set_uniforms(GLuint program, const char *path) {
    FILE *file = fopen(path, "r");
    if (!file) quit("cannot read", path);
    int components, count;
    char name[32];
    static float values[3 * 1024];
    while (fscanf(file, "%d %31s %d", &components, name, &count) == 3) {
        if (count < 1 || count > 1024) quit("too many values of", name);
        for (int i = 0; i < components * count; i++)
            if (fscanf(file, "%f", &values[i]) != 1) quit("too few values of", name);
        GLint place = get_uniform(program, name);
        if (components == 1)
            set_floats(place, count, values);
        else
            set_vectors(place, count, values);
    }
    fclose(file);
}

/* The picture is drawn into. Where the shader does not encode, the framebuffer does. */
static void make_target(int size, int encodes) {
    GLuint frame, pixels;
    gen_framebuffers(1, &frame);
    bind_framebuffer(GL_FRAMEBUFFER, frame);
    gen_renderbuffers(1, &pixels);
    bind_renderbuffer(GL_RENDERBUFFER, pixels);
    renderbuffer_storage(GL_RENDERBUFFER, encodes ? GL_SRGB8_ALPHA8 : GL_RGBA8, size, size);
    framebuffer_renderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, pixels);
    if (check_framebuffer(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) quit("no framebuffer", "");
    if (encodes) enable(GL_FRAMEBUFFER_SRGB);
    viewport(0, 0, size, size);
}

static double seconds_of(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* GL's first row is the lowest one. */
static void write_picture(const char *path, const unsigned char *rgba, int size) {
    FILE *file = fopen(path, "wb");
    if (!file) quit("cannot write", path);
    fprintf(file, "P6 %d %d 255\n", size, size);
    for (int y = size - 1; y >= 0; y--)
        for (int x = 0; x < size; x++) fwrite(rgba + 4 * (y * size + x), 1, 3, file);
    fclose(file);
}

int main(int argc, char **argv) {
    int rounds = argc == 6 ? atoi(argv[1]) : 0, size = argc == 6 ? atoi(argv[2]) : 0;
    if (rounds < 1 || size < 1 || size > 4096) {
        fputs("usage: osmesa ROUNDS SIZE SHADER UNIFORMS PICTURE.ppm\n", stderr);
        return 2;
    }
    const int wanted[] = {OSMESA_FORMAT,
                          OSMESA_RGBA,
                          OSMESA_PROFILE,
                          OSMESA_CORE_PROFILE,
                          OSMESA_CONTEXT_MAJOR_VERSION,
                          3,
                          OSMESA_CONTEXT_MINOR_VERSION,
                          3,
                          0};
    OSMesaContext context = OSMesaCreateContextAttribs(wanted, NULL);
    unsigned char *window = calloc(4, 16 * 16), *rgba = calloc(4, (size_t)(size * size));
    if (!context || !window || !rgba ||
        !OSMesaMakeCurrent(context, window, GL_UNSIGNED_BYTE, 16, 16))
        quit("no context", "");
    look_up_all();
    char *fragment = read_file(argv[3]);
    set_uniforms(make_program(fragment), argv[4]);
    make_target(size, !strstr(fragment, "#define ENCODE"));

    double *wall = calloc((size_t)rounds, sizeof *wall), *cpu = calloc((size_t)rounds, sizeof *cpu);
    if (!wall || !cpu) quit("out of memory", "");
    for (int i = -3; i < rounds; i++) { /* the first ones compile */
        double began = seconds_of(CLOCK_MONOTONIC), used = seconds_of(CLOCK_PROCESS_CPUTIME_ID);
        draw_arrays(GL_TRIANGLES, 0, 3);
        read_pixels(0, 0, size, size, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
        if (i < 0) continue;
        wall[i] = seconds_of(CLOCK_MONOTONIC) - began;
        cpu[i] = seconds_of(CLOCK_PROCESS_CPUTIME_ID) - used;
    }
    write_picture(argv[5], rgba, size);

    printf("{\"renderer\": \"%s\", \"version\": \"%s\"", (const char *)get_string(GL_RENDERER),
           (const char *)get_string(GL_VERSION));
    for (int which = 0; which < 2; which++) {
        printf(", \"%s\": [", which ? "cpu" : "wall");
        for (int i = 0; i < rounds; i++) printf("%s%.7f", i ? ", " : "", which ? cpu[i] : wall[i]);
        putchar(']');
    }
    puts("}");
    free(wall), free(cpu), free(fragment), free(rgba);
    OSMesaDestroyContext(context);
    free(window);
    return 0;
}
