// SPDX-License-Identifier: MIT
//
// The functions of OpenGL 3.3 that are needed. Internal.
module;
#include <GL/glcorearb.h>

module cilantro.window:gl_functions;

import cilantro.standard;
import :desktop;

namespace cilantro {

using gl_function = void (*)();

/// As the context has them that is current when this is made, by name.
struct gl_functions {
  explicit gl_functions(gl_function (*by_name)(const char*)) : by_name_{by_name} {}

 private:
  gl_function (*by_name_)(const char*);
  template <class Function>
  Function load(const char* name) {
    const auto function = reinterpret_cast<Function>(by_name_(name));
    if (function == nullptr) throw_window_error(std::string{"the driver of OpenGL has no "} + name);
    return function;
  }

 public:
#define CILANTRO_GL_FUNCTIONS(F)                                 \
  F(PFNGLACTIVETEXTUREPROC, ActiveTexture)                       \
  F(PFNGLATTACHSHADERPROC, AttachShader)                         \
  F(PFNGLBINDBUFFERPROC, BindBuffer)                             \
  F(PFNGLBINDFRAMEBUFFERPROC, BindFramebuffer)                   \
  F(PFNGLBINDTEXTUREPROC, BindTexture)                           \
  F(PFNGLBINDVERTEXARRAYPROC, BindVertexArray)                   \
  F(PFNGLBLENDFUNCPROC, BlendFunc)                               \
  F(PFNGLBLITFRAMEBUFFERPROC, BlitFramebuffer)                   \
  F(PFNGLBUFFERDATAPROC, BufferData)                             \
  F(PFNGLCLEARPROC, Clear)                                       \
  F(PFNGLCLEARCOLORPROC, ClearColor)                             \
  F(PFNGLCOLORMASKPROC, ColorMask)                               \
  F(PFNGLCOMPILESHADERPROC, CompileShader)                       \
  F(PFNGLCREATEPROGRAMPROC, CreateProgram)                       \
  F(PFNGLCREATESHADERPROC, CreateShader)                         \
  F(PFNGLDELETEBUFFERSPROC, DeleteBuffers)                       \
  F(PFNGLDELETEFRAMEBUFFERSPROC, DeleteFramebuffers)             \
  F(PFNGLDELETESHADERPROC, DeleteShader)                         \
  F(PFNGLDELETETEXTURESPROC, DeleteTextures)                     \
  F(PFNGLDEPTHFUNCPROC, DepthFunc)                               \
  F(PFNGLDEPTHMASKPROC, DepthMask)                               \
  F(PFNGLDISABLEPROC, Disable)                                   \
  F(PFNGLDISABLEVERTEXATTRIBARRAYPROC, DisableVertexAttribArray) \
  F(PFNGLDRAWARRAYSPROC, DrawArrays)                             \
  F(PFNGLDRAWARRAYSINSTANCEDPROC, DrawArraysInstanced)           \
  F(PFNGLDRAWELEMENTSPROC, DrawElements)                         \
  F(PFNGLENABLEPROC, Enable)                                     \
  F(PFNGLENABLEVERTEXATTRIBARRAYPROC, EnableVertexAttribArray)   \
  F(PFNGLFRAMEBUFFERTEXTURE2DPROC, FramebufferTexture2D)         \
  F(PFNGLGENBUFFERSPROC, GenBuffers)                             \
  F(PFNGLGENFRAMEBUFFERSPROC, GenFramebuffers)                   \
  F(PFNGLGENTEXTURESPROC, GenTextures)                           \
  F(PFNGLGENVERTEXARRAYSPROC, GenVertexArrays)                   \
  F(PFNGLGETERRORPROC, GetError)                                 \
  F(PFNGLGETPROGRAMIVPROC, GetProgramiv)                         \
  F(PFNGLGETSHADERINFOLOGPROC, GetShaderInfoLog)                 \
  F(PFNGLGETSHADERIVPROC, GetShaderiv)                           \
  F(PFNGLGETSTRINGPROC, GetString)                               \
  F(PFNGLGETUNIFORMLOCATIONPROC, GetUniformLocation)             \
  F(PFNGLLINKPROGRAMPROC, LinkProgram)                           \
  F(PFNGLPIXELSTOREIPROC, PixelStorei)                           \
  F(PFNGLREADPIXELSPROC, ReadPixels)                             \
  F(PFNGLSHADERSOURCEPROC, ShaderSource)                         \
  F(PFNGLTEXIMAGE2DPROC, TexImage2D)                             \
  F(PFNGLTEXPARAMETERIPROC, TexParameteri)                       \
  F(PFNGLTEXSUBIMAGE2DPROC, TexSubImage2D)                       \
  F(PFNGLUNIFORM1FPROC, Uniform1f)                               \
  F(PFNGLUNIFORM1IPROC, Uniform1i)                               \
  F(PFNGLUNIFORM2FPROC, Uniform2f)                               \
  F(PFNGLUNIFORM3FPROC, Uniform3f)                               \
  F(PFNGLUNIFORMMATRIX3FVPROC, UniformMatrix3fv)                 \
  F(PFNGLUSEPROGRAMPROC, UseProgram)                             \
  F(PFNGLVERTEXATTRIB4FPROC, VertexAttrib4f)                     \
  F(PFNGLVERTEXATTRIBDIVISORPROC, VertexAttribDivisor)           \
  F(PFNGLVERTEXATTRIBPOINTERPROC, VertexAttribPointer)           \
  F(PFNGLVIEWPORTPROC, Viewport)

#define CILANTRO_GL_DECLARE(type, name) type name = load<type>("gl" #name);
  CILANTRO_GL_FUNCTIONS(CILANTRO_GL_DECLARE)
#undef CILANTRO_GL_DECLARE
#undef CILANTRO_GL_FUNCTIONS
};

}  // namespace cilantro
