// SPDX-License-Identifier: MIT
//
// What is on the graphics card: programs, numbers, pixels. Internal.
module;
#include <GL/glcorearb.h>

module cilantro.window:card_objects;

import cilantro.standard;
import cilantro.visualization;
import :gl_functions;
import :on_screen;

namespace cilantro {

[[noreturn]] inline void throw_card_error(const std::string& cause) {
  throw window_error{"the graphics card cannot draw this: " + cause +
                     "; render(scene, view) draws it by the processor"};
}

/// A program for the graphics card, of two shaders.
class card_program {
 public:
  card_program(const gl_functions& gl, const std::string& kind, const std::string& defines)
      : gl_{&gl}, id_{gl.CreateProgram()} {
    const auto whole = [&](const std::string& stage) {
      return "#version 330 core\n" + defines + detail::shader("common") +
             (kind == "resolve" ? "" : detail::shader(stage)) + detail::shader(kind + "." + stage);
    };
    add(GL_VERTEX_SHADER, whole("vertex"));
    add(GL_FRAGMENT_SHADER, whole("fragment"));
    gl.LinkProgram(id_);
    GLint is_linked = 0;
    gl.GetProgramiv(id_, GL_LINK_STATUS, &is_linked);
    if (!is_linked) throw_card_error("the driver of OpenGL links no shaders");
  }

  void use() const { gl_->UseProgram(id_); }
  void set(const char* name, double x) { gl_->Uniform1f(at(name), float(x)); }
  void set(const char* name, int x) { gl_->Uniform1i(at(name), x); }
  void set(const char* name, bool x) { gl_->Uniform1i(at(name), x ? 1 : 0); }
  void set(const char* name, const Eigen::Vector2f& x) { gl_->Uniform2f(at(name), x[0], x[1]); }
  void set(const char* name, const Eigen::Vector3f& x) {
    gl_->Uniform3f(at(name), x[0], x[1], x[2]);
  }
  void set(const char* name, const Eigen::Matrix3f& x) {
    gl_->UniformMatrix3fv(at(name), 1, GL_FALSE, x.data());
  }

 private:
  void add(GLenum stage, const std::string& source) {
    const GLuint shader = gl_->CreateShader(stage);
    const GLchar* text = source.c_str();
    gl_->ShaderSource(shader, 1, &text, nullptr);
    gl_->CompileShader(shader);
    GLint is_compiled = 0;
    gl_->GetShaderiv(shader, GL_COMPILE_STATUS, &is_compiled);
    if (!is_compiled) {
      std::array<char, 400> log{};
      gl_->GetShaderInfoLog(shader, GLsizei(log.size()), nullptr, log.data());
      throw_card_error(std::string{"the driver of OpenGL compiles no shaders: "} + log.data());
    }
    gl_->AttachShader(id_, shader);
    gl_->DeleteShader(shader);
  }
  /// −1, which is nowhere, for what a program does without.
  GLint at(const char* name) {
    const auto [known, is_new] = places_.try_emplace(name, -1);
    if (is_new) known->second = gl_->GetUniformLocation(id_, name);
    return known->second;
  }

  const gl_functions* gl_;
  GLuint id_;
  std::map<std::string, GLint, std::less<>> places_;
};

/// What is on the graphics card under a number, until `Delete`, a function of OpenGL.
template <auto Delete>
class card_object {
 public:
  card_object() = default;
  card_object(card_object&& other) noexcept : gl_{other.gl_}, id_{std::exchange(other.id_, 0)} {}
  card_object& operator=(card_object&& other) noexcept {
    gl_ = std::exchange(other.gl_, gl_);
    id_ = std::exchange(other.id_, id_);
    return *this;
  }
  ~card_object() {
    if (id_ != 0) (gl_->*Delete)(1, &id_);
  }
  [[nodiscard]] GLuint id() const { return id_; }
  explicit operator bool() const { return id_ != 0; }

 protected:
  card_object(const gl_functions& gl, auto generate) : gl_{&gl} { generate(1, &id_); }
  void expect_no_error(const char* otherwise) const {
    if (gl_->GetError() != GL_NO_ERROR) throw_card_error(otherwise);
  }

 private:
  const gl_functions* gl_ = nullptr;
  GLuint id_ = 0;
};

/// Numbers.
class card_buffer : public card_object<&gl_functions::DeleteBuffers> {
 public:
  card_buffer() = default;
  template <class Matrix>
  card_buffer(const gl_functions& gl, const Matrix& columns) : card_object{gl, gl.GenBuffers} {
    gl.BindBuffer(GL_ARRAY_BUFFER, id());
    gl.BufferData(GL_ARRAY_BUFFER,
                  std::ptrdiff_t(columns.size()) * std::ptrdiff_t(sizeof(*columns.data())),
                  columns.data(), GL_STATIC_DRAW);
    expect_no_error("it has too little memory for this scene");
  }
};

/// Pixels.
class card_texture : public card_object<&gl_functions::DeleteTextures> {
 public:
  card_texture() = default;
  card_texture(const gl_functions& gl, GLint stored, GLenum format, GLenum type, int width,
               int height, const void* pixels = nullptr)
      : card_object{gl, gl.GenTextures} {
    gl.BindTexture(GL_TEXTURE_2D, id());
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    gl.TexImage2D(GL_TEXTURE_2D, 0, stored, width, height, 0, format, type, pixels);
    expect_no_error("it holds no texture or picture of this size");
  }
};

/// What can be drawn into.
class card_target : public card_object<&gl_functions::DeleteFramebuffers> {
 public:
  card_target() = default;
  card_target(const gl_functions& gl, const card_texture& color, const card_texture* depth)
      : card_object{gl, gl.GenFramebuffers} {
    gl.BindFramebuffer(GL_FRAMEBUFFER, id());
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color.id(), 0);
    if (depth)
      gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth->id(), 0);
  }
};

}  // namespace cilantro
