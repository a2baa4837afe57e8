// SPDX-License-Identifier: MIT
//
// A picture on the graphics card, copied into the current window pixel by pixel. Internal.
module;
#define GLFW_INCLUDE_NONE
#include <GL/glcorearb.h>
#include <GLFW/glfw3.h>

#include <string>
module cilantro.window:picture_texture;

import cilantro.core;
import :desktop;

namespace cilantro {

/// The functions of OpenGL that are needed, as the current context has them.
struct gl_functions {
  PFNGLGENTEXTURESPROC gen_textures;
  PFNGLBINDTEXTUREPROC bind_texture;
  PFNGLTEXPARAMETERIPROC tex_parameter;
  PFNGLPIXELSTOREIPROC pixel_store;
  PFNGLTEXIMAGE2DPROC tex_image;
  PFNGLTEXSUBIMAGE2DPROC tex_sub_image;
  PFNGLGENFRAMEBUFFERSPROC gen_framebuffers;
  PFNGLBINDFRAMEBUFFERPROC bind_framebuffer;
  PFNGLFRAMEBUFFERTEXTURE2DPROC framebuffer_texture;
  PFNGLBLITFRAMEBUFFERPROC blit_framebuffer;

  gl_functions() {
    load(gen_textures, "glGenTextures");
    load(bind_texture, "glBindTexture");
    load(tex_parameter, "glTexParameteri");
    load(pixel_store, "glPixelStorei");
    load(tex_image, "glTexImage2D");
    load(tex_sub_image, "glTexSubImage2D");
    load(gen_framebuffers, "glGenFramebuffers");
    load(bind_framebuffer, "glBindFramebuffer");
    load(framebuffer_texture, "glFramebufferTexture2D");
    load(blit_framebuffer, "glBlitFramebuffer");
  }

 private:
  template <class Function>
  static void load(Function& function, const char* name) {
    function = reinterpret_cast<Function>(glfwGetProcAddress(name));
    if (function == nullptr) throw_window_error(std::string{"the driver of OpenGL has no "} + name);
  }
};

/// Belongs to the context that is current when it is made, and goes with it. That one must be
/// current in all calls.
class picture_texture {
 public:
  picture_texture() {
    gl_.gen_textures(1, &texture_);
    gl_.bind_texture(GL_TEXTURE_2D, texture_);
    // Without smaller copies of it, which the driver would wait for.
    gl_.tex_parameter(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
    gl_.pixel_store(GL_UNPACK_ALIGNMENT, 1);
    gl_.gen_framebuffers(1, &framebuffer_);
    gl_.bind_framebuffer(GL_READ_FRAMEBUFFER, framebuffer_);
  }

  void set(const image<rgb>& picture) {
    const void* pixels = picture.pixels().data();
    if (picture.width() == width_ && picture.height() == height_) {
      gl_.tex_sub_image(GL_TEXTURE_2D, 0, 0, 0, width_, height_, GL_RGB, GL_UNSIGNED_BYTE, pixels);
      return;
    }
    width_ = picture.width();
    height_ = picture.height();
    gl_.tex_image(GL_TEXTURE_2D, 0, GL_RGBA8, width_, height_, 0, GL_RGB, GL_UNSIGNED_BYTE, pixels);
    gl_.framebuffer_texture(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_, 0);
  }

  /// Upside down, since rows of OpenGL go up and those of pictures down.
  void draw() const {
    gl_.blit_framebuffer(0, 0, width_, height_, 0, height_, width_, 0, GL_COLOR_BUFFER_BIT,
                         GL_NEAREST);
  }

 private:
  gl_functions gl_;
  GLuint texture_ = 0, framebuffer_ = 0;
  int width_ = 0, height_ = 0;
};

}  // namespace cilantro
