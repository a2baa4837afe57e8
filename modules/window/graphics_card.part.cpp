// SPDX-License-Identifier: MIT
//
// Pictures by OpenGL 3.3, alike to those of `render`. Internal. Why: docs/decisions/0028-windows.md
module;
#include <GL/glcorearb.h>

module cilantro.window:graphics_card;

import cilantro.standard;
import cilantro.visualization;
import :card_objects;
import :gl_functions;

namespace cilantro {

/// What a layer consists of, on the graphics card.
struct card_layer {
  struct points {
    const point_batch* batch;
    card_buffer positions, colors, normals;
    float smallest, largest;
  };
  struct lines {
    const line_batch* batch;
    card_buffer ends, colors;
  };
  struct triangles {
    const triangle_batch* batch;
    card_buffer positions, colors, normals, texture_places, indices;
    card_texture texture;
  };
  std::shared_ptr<const canvas> content;  ///< Kept, since the batches are its.
  std::vector<points> all_points;
  std::vector<lines> all_lines;
  std::vector<triangles> all_triangles;
  Eigen::AlignedBox3d bounds;

  card_layer(const gl_functions& gl, std::shared_ptr<const canvas> from)
      : content{std::move(from)}, bounds{content->bounds()} {
    for (const auto& batch : content->points()) {
      const auto vertices = detail::vertices_of(batch);
      all_points.push_back(
          {&batch, card_buffer{gl, batch.points}, card_buffer{gl, vertices.colors},
           batch.normals.cols() > 0 ? card_buffer{gl, vertices.normals} : card_buffer{},
           vertices.smallest, vertices.largest});
    }
    for (const auto& batch : content->lines()) {
      Eigen::Matrix3Xf ends(3, 2 * batch.segments.cols());
      for (index_t i = 0; i < batch.segments.size(); ++i)
        ends.col(i) = batch.points.col(batch.segments(i % 2, i / 2));
      all_lines.push_back({&batch, card_buffer{gl, ends}, colors_of(gl, batch)});
    }
    for (const auto& batch : content->triangles()) {
      all_triangles.push_back(
          {.batch = &batch,
           .positions = card_buffer{gl, batch.points},
           .colors = colors_of(gl, batch),
           .normals = batch.normals.cols() > 0 ? card_buffer{gl, batch.normals} : card_buffer{},
           .texture_places = batch.texture ? card_buffer{gl, batch.texture_places} : card_buffer{},
           .indices = card_buffer{gl, batch.triangles},
           .texture = batch.texture ? card_texture{gl, GL_RGB8, GL_RGB, GL_UNSIGNED_BYTE,
                                                   batch.texture->width(), batch.texture->height(),
                                                   batch.texture->pixels().data()}
                                    : card_texture{}});
    }
  }

 private:
  static card_buffer colors_of(const gl_functions& gl, const auto& batch) {
    return batch.colors.cols() > 1 ? card_buffer{gl, batch.colors} : card_buffer{};
  }
};

/// Belongs to the context that is current when it is made, which must be current in all calls.
class graphics_card {
 public:
  explicit graphics_card(const gl_functions& gl) : gl_{gl} { gl_.GenVertexArrays(1, &vertices_); }

  /// What the driver calls what draws.
  [[nodiscard]] static std::string name_of(const gl_functions& gl) {
    const auto* name = reinterpret_cast<const char*>(gl.GetString(GL_RENDERER));
    return name ? name : "";
  }
  /// Whether what is called so draws by the processor, which `render` does faster.
  [[nodiscard]] static bool is_software(const gl_functions& gl) {
    const std::string text = name_of(gl);
    return std::ranges::any_of(
        std::array<std::string_view, 4>{"llvmpipe", "softpipe", "SwiftShader", "Software"},
        [&](std::string_view one) { return text.find(one) != text.npos; });
  }

  /// As `render` of these options, with the size of the picture.
  [[nodiscard]] image<rgb> draw(const scene& all, const view& from, const render_options& options) {
    const int fine = options.supersampling;
    const int width = options.width > 0 ? options.width : from.camera.width;
    const int height = options.height > 0 ? options.height : from.camera.height;
    take_layers(all);
    make_targets(width * fine, height * fine);
    set_camera(all, from, options);
    gl_.BindVertexArray(vertices_);
    gl_.Viewport(0, 0, width_, height_);
    draw_opaque(all, options);
    const bool has_veils = draw_veils(all);
    resolve(options, has_veils);
    auto picture = read(width, height, fine);
    detail::draw_texts(picture, all, from, options);
    return picture;
  }

 private:
  enum mode { colors, depths, sums, veils, passed };

  void take_layers(const scene& all) {
    std::map<const canvas*, card_layer> kept;
    for (const auto& layer : all.layers())
      if (auto known = layers_.extract(layer.content.get())) kept.insert(std::move(known));
    layers_ = std::move(kept);
    for (const auto& layer : all.layers())
      if (!layer.is_hidden && !layers_.contains(layer.content.get()))
        layers_.emplace(layer.content.get(), card_layer{gl_, layer.content});
  }
  void for_layers(const scene& all, auto&& f) {
    for (const auto& layer : all.layers())
      if (!layer.is_hidden) f(layers_.at(layer.content.get()));
  }

  void make_targets(int width, int height) {
    if (width == width_ && height == height_) return;
    // Half of the digits would be full after some hundred points in a pixel.
    const auto floats = [&] {
      return card_texture{gl_, GL_RGBA32F, GL_RGBA, GL_FLOAT, width, height};
    };
    depths_ = card_texture{gl_, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT, width, height};
    sums_ = floats();
    veils_ = floats();
    passed_ = floats();
    result_ = card_texture{gl_, GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, width, height};
    opaque_target_ = card_target{gl_, sums_, &depths_};
    veil_target_ = card_target{gl_, veils_, &depths_};
    passed_target_ = card_target{gl_, passed_, &depths_};
    result_target_ = card_target{gl_, result_, nullptr};
    width_ = width;
    height_ = height;
  }

  void set_camera(const scene& all, const view& from, const render_options& options) {
    from_ = &from;
    fine_ = options.supersampling;
    camera_ = detail::camera_of(from, width_, height_);
    far_ = 1e-3 * from.distance;
    index_t points = 0;
    double farthest_splat = 0;
    for_layers(all, [&](const card_layer& layer) {
      if (layer.bounds.isEmpty()) return;
      double reach = 0;
      for (const auto& one : layer.all_points) {
        points += one.batch->points.cols();
        if (one.batch->size.in == point_size::unit::length)
          reach = std::max(reach, double(one.largest));
      }
      farthest_splat = std::max(farthest_splat, reach);
      const Eigen::Vector3d middle = layer.bounds.center();
      const double radius = (layer.bounds.max() - layer.bounds.min()).norm() / 2;
      far_ = std::max(far_, (camera_.to_camera * (middle - camera_.eye)).z() + radius);
    });
    // Of attributes that are farther apart, drivers need know nothing.
    constexpr index_t most = 2048 / 12;
    stride_ = options.point_budget > 0
                  ? std::clamp<index_t>((points + options.point_budget - 1) / options.point_budget,
                                        1, most)
                  : 1;
    // Discs reach behind their middles, those in pixels by some of them.
    far_ = 1.01 * (far_ + farthest_splat * std::sqrt(double(stride_)) / 2) *
           (1 + 512.0 * fine_ / camera_.fx * (from.orthographic ? 0 : 1));
  }

  card_program& begin(card_program& program, mode how, const auto& batch) {
    program.use();
    program.set("linear", Eigen::Matrix3f{camera_.to_camera.cast<float>()});
    program.set(
        "offset",
        Eigen::Vector3f{(camera_.to_camera * (batch.origin - camera_.eye)).template cast<float>()});
    set_picture(program);
    program.set("near", camera_.nearest);
    program.set("opacity", batch.opacity);
    program.set("lookedAt", from_->distance);
    program.set("mode", int(how));
    return program;
  }
  void set_picture(card_program& program) {
    program.set("focal", Eigen::Vector2f{float(camera_.fx), float(camera_.fy)});
    program.set("center", Eigen::Vector2f{float(camera_.cx), float(camera_.cy)});
    program.set("size", Eigen::Vector2f{float(width_), float(height_)});
    program.set("far", far_);
    program.set("isOrthographic", from_->orthographic);
  }
  void attribute(GLuint place, const card_buffer& buffer, int count, GLenum type, int stride,
                 int step = 0, int offset = 0) {
    if (!buffer) {
      gl_.DisableVertexAttribArray(place);
      return;
    }
    gl_.BindBuffer(GL_ARRAY_BUFFER, buffer.id());
    gl_.EnableVertexAttribArray(place);
    gl_.VertexAttribPointer(
        place, count, type, type == GL_FLOAT ? GL_FALSE : GL_TRUE, stride,
        reinterpret_cast<const void*>(std::intptr_t{offset}));  // NOLINT: OpenGL's way to say it.
    gl_.VertexAttribDivisor(place, GLuint(step));
  }
  void color_attribute(GLuint place, const card_buffer& buffer, const color_matrix& own,
                       int step = 0) {
    attribute(place, buffer, 3, GL_UNSIGNED_BYTE, 3, step);
    if (!buffer && own.cols() > 0)
      gl_.VertexAttrib4f(place, float(own(0, 0)) / 255, float(own(1, 0)) / 255,
                         float(own(2, 0)) / 255, 0);
  }

  void draw(const card_layer::points& one, mode how) {
    const auto& batch = *one.batch;
    const bool is_length = batch.size.in == point_size::unit::length;
    const int n = int(stride_);
    auto& program = begin(batch.along_normals ? discs_ : points_, how, batch);
    program.set("isLength", is_length);
    program.set("hasNormals", bool(one.normals));
    program.set("isLit", batch.lit);
    program.set("sizes", Eigen::Vector2f{one.smallest, one.largest});
    program.set("growth", is_length ? std::sqrt(double(n)) : 1.0);
    program.set("pixelRatio", double(fine_));
    program.set("largest", 1024.0 * fine_);
    attribute(0, one.positions, 3, GL_FLOAT, 12 * n, 1);
    attribute(1, one.colors, 4, GL_UNSIGNED_BYTE, 4 * n, 1);
    attribute(2, one.normals, 2, GL_BYTE, 2 * n, 1);
    attribute(3, {}, 0, GL_FLOAT, 0);
    gl_.DrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, GLsizei((batch.points.cols() + n - 1) / n));
  }
  void draw(const card_layer::lines& one, mode how) {
    const auto& batch = *one.batch;
    auto& program = begin(lines_, how, batch);
    program.set("width", std::max(1.0, batch.width * fine_));
    attribute(0, one.ends, 3, GL_FLOAT, 24, 1);
    attribute(1, one.ends, 3, GL_FLOAT, 24, 1, 12);
    color_attribute(2, one.colors, batch.colors, 1);
    attribute(3, {}, 0, GL_FLOAT, 0);
    gl_.DrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, GLsizei(batch.segments.cols()));
  }
  void draw(const card_layer::triangles& one, mode how) {
    const auto& batch = *one.batch;
    auto& program = begin(triangles_, how, batch);
    program.set("hasNormals", bool(one.normals));
    program.set("hasTexture", bool(one.texture));
    program.set("isLit", batch.lit);
    program.set("photo", 0);
    gl_.ActiveTexture(GL_TEXTURE0);
    gl_.BindTexture(GL_TEXTURE_2D, one.texture.id());
    attribute(0, one.positions, 3, GL_FLOAT, 12);
    color_attribute(1, one.colors, batch.colors);
    attribute(2, one.normals, 3, GL_FLOAT, 12);
    attribute(3, one.texture_places, 2, GL_FLOAT, 8);
    gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, one.indices.id());
    gl_.DrawElements(GL_TRIANGLES, GLsizei(batch.triangles.size()), GL_UNSIGNED_INT, nullptr);
  }
  static index_t count_of(const point_batch& batch) { return batch.points.cols(); }
  static index_t count_of(const line_batch& batch) { return batch.segments.cols(); }
  static index_t count_of(const triangle_batch& batch) { return batch.triangles.cols(); }
  void draw_where(const auto& things, mode how, auto&& is_wanted) {
    for (const auto& one : things)
      if (is_wanted(one.batch->opacity) && count_of(*one.batch) > 0) draw(one, how);
  }

  void draw_opaque(const scene& all, const render_options& options) {
    const auto opaque = [](double opacity) { return opacity == 1; };
    const auto draw_points = [&](mode how) {
      for_layers(all, [&](const card_layer& layer) { draw_where(layer.all_points, how, opaque); });
    };
    const auto draw_others = [&](mode how) {
      for_layers(all, [&](const card_layer& layer) {
        draw_where(layer.all_lines, how, opaque);
        draw_where(layer.all_triangles, how, opaque);
      });
    };
    gl_.BindFramebuffer(GL_FRAMEBUFFER, opaque_target_.id());
    gl_.Enable(GL_DEPTH_TEST);
    gl_.DepthFunc(GL_LEQUAL);
    gl_.DepthMask(GL_TRUE);
    gl_.Disable(GL_BLEND);
    gl_.ClearColor(0, 0, 0, 0);
    gl_.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    if (!options.blend) {
      draw_points(colors);
      draw_others(colors);
      return;
    }
    gl_.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    draw_points(depths);
    draw_others(depths);
    gl_.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    gl_.DepthMask(GL_FALSE);
    gl_.Enable(GL_BLEND);
    gl_.BlendFunc(GL_ONE, GL_ONE);
    draw_points(sums);
    gl_.Disable(GL_BLEND);
    draw_others(colors);
  }
  /// Whether there are any.
  bool draw_veils(const scene& all) {
    const auto veiled = [](double opacity) { return opacity > 0 && opacity < 1; };
    bool any = false;
    for_layers(all, [&](const card_layer& layer) {
      const auto has = [&](const auto& things) {
        return std::ranges::any_of(things,
                                   [&](const auto& one) { return veiled(one.batch->opacity); });
      };
      any |= has(layer.all_points) || has(layer.all_lines) || has(layer.all_triangles);
    });
    if (!any) return false;
    const auto draw_all = [&](mode how) {
      for_layers(all, [&](const card_layer& layer) {
        draw_where(layer.all_points, how, veiled);
        draw_where(layer.all_lines, how, veiled);
        draw_where(layer.all_triangles, how, veiled);
      });
    };
    gl_.DepthMask(GL_FALSE);
    gl_.Enable(GL_BLEND);
    gl_.BindFramebuffer(GL_FRAMEBUFFER, veil_target_.id());
    gl_.ClearColor(0, 0, 0, 0);
    gl_.Clear(GL_COLOR_BUFFER_BIT);
    gl_.BlendFunc(GL_ONE, GL_ONE);
    draw_all(veils);
    gl_.BindFramebuffer(GL_FRAMEBUFFER, passed_target_.id());
    gl_.ClearColor(1, 1, 1, 1);
    gl_.Clear(GL_COLOR_BUFFER_BIT);
    gl_.BlendFunc(GL_ZERO, GL_ONE_MINUS_SRC_COLOR);
    draw_all(passed);
    gl_.Disable(GL_BLEND);
    return true;
  }

  void resolve(const render_options& options, bool has_veils) {
    gl_.BindFramebuffer(GL_FRAMEBUFFER, result_target_.id());
    gl_.Disable(GL_DEPTH_TEST);
    resolve_.use();
    const std::array textures{std::pair{"sums", &sums_}, std::pair{"depths", &depths_},
                              std::pair{"veils", &veils_}, std::pair{"passed", &passed_}};
    for (std::size_t k = 0; k < textures.size(); ++k) {
      gl_.ActiveTexture(GL_TEXTURE0 + GLenum(k));
      gl_.BindTexture(GL_TEXTURE_2D, textures[k].second->id());
      resolve_.set(textures[k].first, int(k));
    }
    gl_.ActiveTexture(GL_TEXTURE0);
    set_picture(resolve_);
    const auto& background = options.background;
    resolve_.set("background",
                 Eigen::Vector3f{float(background[0]) / 255, float(background[1]) / 255,
                                 float(background[2]) / 255});
    resolve_.set("edges", options.edges);
    resolve_.set("reach", std::max(2 * fine_, int(std::lround(height_ / 360.0))));
    resolve_.set("hasVeils", has_veils);
    for (GLuint k = 0; k < 4; ++k) gl_.DisableVertexAttribArray(k);
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
  }
  /// The means of `fine` by `fine` pixels. Rows of OpenGL go up, those of pictures down.
  [[nodiscard]] image<rgb> read(int width, int height, int fine) const {
    std::vector<std::uint8_t> pixels(std::size_t(4) * std::size_t(width_) * std::size_t(height_));
    gl_.PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl_.ReadPixels(0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
    image<rgb> picture(width, height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        for (int k = 0; k < 3; ++k) {
          int sum = fine * fine / 2;
          for (int v = 0; v < fine; ++v)
            for (int u = 0; u < fine; ++u) {
              const int row = height_ - 1 - (y * fine + v), column = x * fine + u;
              sum += pixels[std::size_t(4) *
                                (std::size_t(row) * std::size_t(width_) + std::size_t(column)) +
                            std::size_t(k)];
            }
          picture(x, y)[std::size_t(k)] = std::uint8_t(sum / (fine * fine));
        }
    return picture;
  }

  const gl_functions& gl_;
  card_program points_{gl_, "points", "#define QUADS\n"},
      discs_{gl_, "points", "#define QUADS\n#define DISC\n"}, lines_{gl_, "lines", ""},
      triangles_{gl_, "triangles", ""}, resolve_{gl_, "resolve", ""};
  GLuint vertices_ = 0;
  std::map<const canvas*, card_layer> layers_;

  int width_ = 0, height_ = 0, fine_ = 1;
  card_texture depths_, sums_, veils_, passed_, result_;
  card_target opaque_target_, veil_target_, passed_target_, result_target_;

  const view* from_ = nullptr;  ///< Of the picture in the making.
  detail::picture_camera camera_;
  double far_ = 1;
  index_t stride_ = 1;
};

}  // namespace cilantro
