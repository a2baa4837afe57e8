// SPDX-License-Identifier: MIT
//
// A picture on the graphics card, copied into the current window pixel by pixel. Internal.
module;
#include <GL/glcorearb.h>
module cilantro.window:picture_texture;

import cilantro.core;
import :gl_functions;

namespace cilantro {

/// Belongs to the context that is current when it is made, and goes with it. That one must be
/// current in all calls.
class picture_texture {
 public:
  explicit picture_texture(const gl_functions& gl) : gl_{gl} {
    gl_.GenTextures(1, &texture_);
    gl_.BindTexture(GL_TEXTURE_2D, texture_);
    // Without smaller copies of it, which the driver would wait for.
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
    gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    gl_.GenFramebuffers(1, &framebuffer_);
  }

  void set(const image<rgb>& picture) {
    const void* pixels = picture.pixels().data();
    gl_.BindTexture(GL_TEXTURE_2D, texture_);
    if (picture.width() == width_ && picture.height() == height_) {
      gl_.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width_, height_, GL_RGB, GL_UNSIGNED_BYTE, pixels);
      return;
    }
    width_ = picture.width();
    height_ = picture.height();
    gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width_, height_, 0, GL_RGB, GL_UNSIGNED_BYTE,
                   pixels);
    gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_);
    gl_.FramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_, 0);
  }

  /// Upside down, since rows of OpenGL go up and those of pictures down.
  void draw() const {
    gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_);
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
    gl_.BlitFramebuffer(0, 0, width_, height_, 0, height_, width_, 0, GL_COLOR_BUFFER_BIT,
                        GL_NEAREST);
  }

 private:
  const gl_functions& gl_;
  GLuint texture_ = 0, framebuffer_ = 0;
  int width_ = 0, height_ = 0;
};

}  // namespace cilantro
