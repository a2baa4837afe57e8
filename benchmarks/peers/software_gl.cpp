// SPDX-License-Identifier: MIT
//
// The picture of cilantro by OpenGL 3.3, without a display: by EGL on no surface, which is Mesa's
// llvmpipe where there is no graphics card.
#define GL_GLEXT_PROTOTYPES
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/glcorearb.h>
#include <dlfcn.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "common.hpp"
#include "drawn.hpp"

namespace {

[[noreturn]] void fail(const char* what) {
  std::fprintf(stderr, "no picture by OpenGL: %s\n", what);
  std::exit(1);
}

/// A function of libEGL or OpenGL, which are found when the program runs.
void* (*find_function)(const char*) = nullptr;
#define CILANTRO_GL(type, name) const auto name = reinterpret_cast<type>(find_function(#name))

/// A context without a surface.
struct context {
  context() {
    void* library = dlopen("libEGL.so.1", RTLD_NOW);
    if (!library) fail("there is no libEGL");
    find_function = reinterpret_cast<void* (*)(const char*)>(dlsym(library, "eglGetProcAddress"));
    CILANTRO_GL(PFNEGLGETPLATFORMDISPLAYEXTPROC, eglGetPlatformDisplayEXT);
    CILANTRO_GL(PFNEGLINITIALIZEPROC, eglInitialize);
    CILANTRO_GL(PFNEGLBINDAPIPROC, eglBindAPI);
    CILANTRO_GL(PFNEGLCHOOSECONFIGPROC, eglChooseConfig);
    CILANTRO_GL(PFNEGLCREATECONTEXTPROC, eglCreateContext);
    CILANTRO_GL(PFNEGLMAKECURRENTPROC, eglMakeCurrent);
    const auto display =
        eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (!eglInitialize(display, nullptr, nullptr)) fail("EGL does not start");
    eglBindAPI(EGL_OPENGL_API);
    const EGLint wanted[] = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    eglChooseConfig(display, wanted, &config, 1, &count);
    const EGLint version[] = {EGL_CONTEXT_MAJOR_VERSION,
                              3,
                              EGL_CONTEXT_MINOR_VERSION,
                              3,
                              EGL_CONTEXT_OPENGL_PROFILE_MASK,
                              EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                              EGL_NONE};
    const auto made = eglCreateContext(display, config, EGL_NO_CONTEXT, version);
    if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, made)) fail("no context");
  }
};

/// Depths are linear, so that edges can be found from them. A splat has one depth.
constexpr const char* splat_vertex = R"(#version 330 core
layout(location = 0) in vec3 place;
layout(location = 1) in vec3 color;
uniform mat4x3 to_camera;
uniform vec4 camera;     // Focal lengths, principal point.
uniform vec2 size;
uniform float diameter, farthest;
flat out vec3 splat;     // The middle and the radius, in pixels.
flat out vec3 splat_color;
void main() {
  vec3 p = to_camera * vec4(place, 1);
  float scale = 1 / p.z;
  vec2 middle = camera.xy * p.xy * scale + camera.zw;
  float radius = max(diameter * camera.x * scale / 2, 0.5);
  splat = vec3(middle, radius);
  splat_color = color;
  gl_PointSize = 2 * radius + 1;
  vec2 in_clip = (middle + 0.5) / size * 2 - 1;
  gl_Position = vec4(in_clip * p.z, (2 * p.z / farthest - 1) * p.z, p.z);
})";
constexpr const char* splat_fragment = R"(#version 330 core
flat in vec3 splat;
flat in vec3 splat_color;
out vec4 color;
void main() {
  vec2 away = gl_FragCoord.xy - 0.5 - splat.xy;
  bool covers = splat.z < 0.71 ? max(abs(away.x), abs(away.y)) <= 0.5
                               : dot(away, away) <= splat.z * splat.z;
  if (!covers) discard;
  color = vec4(splat_color, 1);
})";
constexpr const char* edge_vertex = R"(#version 330 core
void main() {
  gl_Position = vec4(4 * (gl_VertexID & 1) - 1, 2 * (gl_VertexID & 2) - 1, 0, 1);
})";
constexpr const char* edge_fragment = R"(#version 330 core
uniform sampler2D colors, depths;
uniform float farthest;
uniform vec3 background;
out vec4 color;
float depth(ivec2 at) {
  ivec2 end = textureSize(depths, 0);
  if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, end))) return -1.0;
  float d = texelFetch(depths, at, 0).r;
  return d == 1.0 ? -1.0 : d;
}
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  float z = depth(at);
  if (z < 0) { color = vec4(background, 1); return; }
  float sum = 0;
  ivec2 steps[4] = ivec2[4](ivec2(2, 0), ivec2(2, 2), ivec2(0, 2), ivec2(-2, 2));
  for (int i = 0; i < 4; ++i) {
    float one = depth(at + steps[i]), other = depth(at - steps[i]);
    float behind = 2 * z - (one < 0 ? z : one) - (other < 0 ? z : other);
    sum += clamp(behind / z, 0.0, 0.04);
  }
  color = vec4(texelFetch(colors, at, 0).rgb / (1 + 12 * sum), 1);
})";

#define CILANTRO_GL_FUNCTIONS(F)                                 \
  F(PFNGLCREATESHADERPROC, glCreateShader)                       \
  F(PFNGLSHADERSOURCEPROC, glShaderSource)                       \
  F(PFNGLCOMPILESHADERPROC, glCompileShader)                     \
  F(PFNGLCREATEPROGRAMPROC, glCreateProgram)                     \
  F(PFNGLATTACHSHADERPROC, glAttachShader)                       \
  F(PFNGLLINKPROGRAMPROC, glLinkProgram)                         \
  F(PFNGLGETPROGRAMIVPROC, glGetProgramiv)                       \
  F(PFNGLUSEPROGRAMPROC, glUseProgram)                           \
  F(PFNGLGETUNIFORMLOCATIONPROC, glGetUniformLocation)           \
  F(PFNGLUNIFORM1FPROC, glUniform1f)                             \
  F(PFNGLUNIFORM1IPROC, glUniform1i)                             \
  F(PFNGLUNIFORM2FPROC, glUniform2f)                             \
  F(PFNGLUNIFORM3FPROC, glUniform3f)                             \
  F(PFNGLUNIFORM4FVPROC, glUniform4fv)                           \
  F(PFNGLUNIFORMMATRIX4X3FVPROC, glUniformMatrix4x3fv)           \
  F(PFNGLGENVERTEXARRAYSPROC, glGenVertexArrays)                 \
  F(PFNGLBINDVERTEXARRAYPROC, glBindVertexArray)                 \
  F(PFNGLGENBUFFERSPROC, glGenBuffers)                           \
  F(PFNGLBINDBUFFERPROC, glBindBuffer)                           \
  F(PFNGLBUFFERDATAPROC, glBufferData)                           \
  F(PFNGLVERTEXATTRIBPOINTERPROC, glVertexAttribPointer)         \
  F(PFNGLENABLEVERTEXATTRIBARRAYPROC, glEnableVertexAttribArray) \
  F(PFNGLGENTEXTURESPROC, glGenTextures)                         \
  F(PFNGLBINDTEXTUREPROC, glBindTexture)                         \
  F(PFNGLTEXIMAGE2DPROC, glTexImage2D)                           \
  F(PFNGLTEXPARAMETERIPROC, glTexParameteri)                     \
  F(PFNGLACTIVETEXTUREPROC, glActiveTexture)                     \
  F(PFNGLGENFRAMEBUFFERSPROC, glGenFramebuffers)                 \
  F(PFNGLBINDFRAMEBUFFERPROC, glBindFramebuffer)                 \
  F(PFNGLFRAMEBUFFERTEXTURE2DPROC, glFramebufferTexture2D)       \
  F(PFNGLENABLEPROC, glEnable)                                   \
  F(PFNGLDISABLEPROC, glDisable)                                 \
  F(PFNGLDEPTHFUNCPROC, glDepthFunc)                             \
  F(PFNGLCLEARPROC, glClear)                                     \
  F(PFNGLVIEWPORTPROC, glViewport)                               \
  F(PFNGLDRAWARRAYSPROC, glDrawArrays)                           \
  F(PFNGLPIXELSTOREIPROC, glPixelStorei)                         \
  F(PFNGLREADPIXELSPROC, glReadPixels)                           \
  F(PFNGLGETSTRINGPROC, glGetString)

/// Points in buffers of OpenGL, and pictures of them.
class renderer {
 public:
  explicit renderer(std::ptrdiff_t count) : count_{count} {
    std::fprintf(stderr, "%s\n", reinterpret_cast<const char*>(gl.glGetString(GL_RENDERER)));
    splats_ = program(splat_vertex, splat_fragment);
    edges_ = program(edge_vertex, edge_fragment);
    upload();
    target(splats_to_, colors_, GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE);
    target(splats_to_, depths_, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT);
    target(result_, picture_, GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE);
    gl.glViewport(0, 0, picture_width, picture_height);
    gl.glEnable(GL_PROGRAM_POINT_SIZE);
    gl.glDepthFunc(GL_LESS);
    gl.glPixelStorei(GL_PACK_ALIGNMENT, 1);
    set_uniforms();
  }

  void draw(std::vector<std::uint8_t>& pixels) {
    gl.glBindFramebuffer(GL_FRAMEBUFFER, splats_to_);
    gl.glEnable(GL_DEPTH_TEST);
    gl.glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    gl.glUseProgram(splats_);
    gl.glBindVertexArray(points_);
    gl.glDrawArrays(GL_POINTS, 0, GLsizei(count_));
    gl.glBindFramebuffer(GL_FRAMEBUFFER, result_);
    gl.glDisable(GL_DEPTH_TEST);
    gl.glUseProgram(edges_);
    gl.glActiveTexture(GL_TEXTURE0);
    gl.glBindTexture(GL_TEXTURE_2D, colors_);
    gl.glActiveTexture(GL_TEXTURE1);
    gl.glBindTexture(GL_TEXTURE_2D, depths_);
    gl.glBindVertexArray(nothing_);
    gl.glDrawArrays(GL_TRIANGLES, 0, 3);
    pixels.resize(std::size_t{3} * picture_width * picture_height);
    gl.glReadPixels(0, 0, picture_width, picture_height, GL_RGB, GL_UNSIGNED_BYTE, pixels.data());
  }

 private:
  GLuint program(const char* vertex, const char* fragment) {
    const auto made = gl.glCreateProgram();
    for (const auto& [kind, text] :
         {std::pair{GL_VERTEX_SHADER, vertex}, std::pair{GL_FRAGMENT_SHADER, fragment}}) {
      const auto shader = gl.glCreateShader(GLenum(kind));
      gl.glShaderSource(shader, 1, &text, nullptr);
      gl.glCompileShader(shader);
      gl.glAttachShader(made, shader);
    }
    gl.glLinkProgram(made);
    GLint is_linked = 0;
    gl.glGetProgramiv(made, GL_LINK_STATUS, &is_linked);
    if (!is_linked) fail("a shader is refused");
    return made;
  }
  void upload() {
    const many_points many{large_points()};
    const auto& own = large_colors();
    std::vector<float> points;
    std::vector<std::uint8_t> colors;
    for (std::size_t i = 0; i < std::size_t(count_); ++i) {
      const auto p = many[i];
      points.insert(points.end(), p.begin(), p.end());
      for (std::size_t k = 0; k < 3; ++k) colors.push_back(own[(3 * i + k) % own.size()]);
    }
    gl.glGenVertexArrays(1, &nothing_);
    gl.glGenVertexArrays(1, &points_);
    gl.glBindVertexArray(points_);
    const auto buffer = [&](GLuint place, const void* data, std::size_t size, GLenum type,
                            GLboolean is_share) {
      GLuint made = 0;
      gl.glGenBuffers(1, &made);
      gl.glBindBuffer(GL_ARRAY_BUFFER, made);
      gl.glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(size), data, GL_STATIC_DRAW);
      gl.glVertexAttribPointer(place, 3, type, is_share, 0, nullptr);
      gl.glEnableVertexAttribArray(place);
    };
    buffer(0, points.data(), points.size() * sizeof(float), GL_FLOAT, GL_FALSE);
    buffer(1, colors.data(), colors.size(), GL_UNSIGNED_BYTE, GL_TRUE);
  }
  void target(GLuint& frame, GLuint& texture, GLint inside, GLenum format, GLenum type) {
    if (frame == 0) gl.glGenFramebuffers(1, &frame);
    gl.glBindFramebuffer(GL_FRAMEBUFFER, frame);
    gl.glGenTextures(1, &texture);
    gl.glBindTexture(GL_TEXTURE_2D, texture);
    gl.glTexImage2D(GL_TEXTURE_2D, 0, inside, picture_width, picture_height, 0, format, type,
                    nullptr);
    gl.glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl.glFramebufferTexture2D(GL_FRAMEBUFFER,
                              format == GL_RGBA ? GL_COLOR_ATTACHMENT0 : GL_DEPTH_ATTACHMENT,
                              GL_TEXTURE_2D, texture, 0);
  }
  void set_uniforms() {
    const auto view = read_floats("view.f32");
    float columns[12];
    for (int i = 0; i < 12; ++i) columns[i] = view[std::size_t(i % 3 * 4 + i / 3)];
    constexpr float farthest = 100;
    gl.glUseProgram(splats_);
    const auto of = [&](GLuint which, const char* name) {
      return gl.glGetUniformLocation(which, name);
    };
    gl.glUniformMatrix4x3fv(of(splats_, "to_camera"), 1, GL_FALSE, columns);
    gl.glUniform4fv(of(splats_, "camera"), 1, view.data() + 12);
    gl.glUniform2f(of(splats_, "size"), picture_width, picture_height);
    gl.glUniform1f(of(splats_, "diameter"), splat_diameter);
    gl.glUniform1f(of(splats_, "farthest"), farthest);
    gl.glUseProgram(edges_);
    gl.glUniform1i(of(edges_, "colors"), 0);
    gl.glUniform1i(of(edges_, "depths"), 1);
    gl.glUniform3f(of(edges_, "background"), background[0] / 255.0f, background[1] / 255.0f,
                   background[2] / 255.0f);
  }

  struct functions {
#define CILANTRO_MEMBER(type, name) type name = reinterpret_cast<type>(find_function(#name));
    CILANTRO_GL_FUNCTIONS(CILANTRO_MEMBER)
  } gl;
  std::ptrdiff_t count_;
  GLuint splats_ = 0, edges_ = 0, points_ = 0, nothing_ = 0;
  GLuint splats_to_ = 0, result_ = 0, colors_ = 0, depths_ = 0, picture_ = 0;
};

void picture_of(benchmark::State& state, std::ptrdiff_t count) {
  static const context current;
  renderer draws{count};
  std::vector<std::uint8_t> pixels;
  for (auto _ : state) {
    draws.draw(pixels);
    benchmark::DoNotOptimize(pixels.data());
  }
  report_picture(state, pixels, count == std::ssize(large_points()) / 3);
}
void picture_nearest(benchmark::State& state) {
  picture_of(state, std::ssize(large_points()) / 3);
}
CILANTRO_BENCHMARK(picture_nearest);
void picture_of_many(benchmark::State& state) {
  picture_of(state, picture_points);
}
CILANTRO_BENCHMARK(picture_of_many);

}  // namespace

int main(int argc, char** argv) {
  limit_drawing_threads();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
