// SPDX-License-Identifier: MIT
module;
#include "core/parallel_backend.hpp"
#include "visualization/kernels/splats.hpp"
module cilantro.visualization;

import :drawing;
import :edges;
import :overlay;
import :projector;
import :rasterize;

namespace cilantro {
namespace {

using color = Eigen::Vector3f;

color color_of(const color_matrix& colors, index_t i) {
  return colors.col(colors.cols() == 1 ? 0 : i).cast<float>();
}
color color_of(const rgb& one) {
  return {float(one[0]), float(one[1]), float(one[2])};
}
/// How bright a surface is that is lit from the eye: both sides alike, and fully without a normal.
float light_on(const Eigen::Vector3f& normal, const Eigen::Vector3f& towards) {
  const float cosine = std::abs(normal.stableNormalized().dot(towards.stableNormalized()));
  return cosine <= 1 ? 0.4f + 0.6f * cosine : 1;
}

using detail::color_sum;
/// The sum over what is transparent in a pixel: colours by weight, and the logarithm of what it
/// lets through.
struct veil {
  std::uint64_t red = 0, green = 0, blue = 0, weight = 0, opaqueness = 0;
};

/// How many halvings of what is behind one thing is, in so many parts of one.
constexpr double opaqueness_unit = 1 << 28;
std::uint64_t opaqueness_of(double opacity) {
  return static_cast<std::uint64_t>(-std::log1p(-opacity) / std::log(2.0) * opaqueness_unit + 0.5);
}

/// `is_alone`: no other thread is there.
void add_to(std::uint64_t& sum, std::uint64_t value, bool is_alone) {
  if (is_alone)
    sum += value;
  else
    std::atomic_ref{sum}.fetch_add(value, std::memory_order_relaxed);
}
/// A colour so many times, that of weight 1.
void add_to(color_sum& sum, const color_sum& own, std::uint64_t weight, bool is_alone) {
  add_to(sum.red_green, own.red_green * weight, is_alone);
  add_to(sum.blue_weight, own.blue_weight * weight, is_alone);
}

/// Places to work in, for as many threads as there are places.
class places {
 public:
  explicit places(std::size_t count) : free_{(1u << count) - 1} {}
  /// `f(place)`, with a place that no other thread has meanwhile.
  void lend(auto&& f) {
    unsigned all = free_.load(std::memory_order_relaxed), taken = 0;
    do {
      taken = all & (0 - all);
    } while (taken == 0 || !free_.compare_exchange_weak(all, all - taken, std::memory_order_acquire,
                                                        std::memory_order_relaxed));
    f(static_cast<std::size_t>(std::countr_zero(taken)));
    free_.fetch_or(taken, std::memory_order_release);
  }

 private:
  std::atomic<unsigned> free_;
};

/// One picture in the making.
class painter {
 public:
  painter(const drawing& all, const projector& by, const render_options& options)
      : all_{all},
        by_{by},
        options_{options},
        how_{options.threads, task_monitor{{}, options.monitor.stop}},
        threads_{options.threads > 0 ? options.threads : detail::threads_of_part(1)},
        stride_{options.point_budget == 0
                    ? 1
                    : std::max<index_t>(1, (index_t(all.first_line) + options.point_budget - 1) /
                                               options.point_budget)},
        nearest_(has_own_ ? static_cast<std::size_t>(threads_) : 1) {
    clear(nearest_, nothing);
  }

  void find_nearest() {
    for (const auto& one : all_.points)
      if (one.batch->opacity == 1)
        draw_splats(one, [&](std::size_t mine, index_t i, const splat& s) {
          const auto number = one.first + static_cast<std::uint32_t>(i);
          const auto key = key_of(s.z, number);
          if (const auto normal = disc_normal(one, i))
            for_pixels(s, *normal, grid_, kernels_.cover_by_disc,
                       [&](index_t pixel, float, float z) {
                         put(nearest_[mine][pixel], key_of(z, number), has_own_);
                       });
          else if (has_own_ && !nine_pixels::suffice(s))
            kernels_.keep_least_of_round(round_of(s, by_), key, grid_, nearest_[mine].data());
          else
            for_pixels(s, by_, [&](index_t pixel, float share) {
              put(nearest_[mine][pixel], share <= 1 ? key : nothing, has_own_);
            });
        });
    gather(nearest_, [](depth_and_number& to, depth_and_number from) { to = std::min(to, from); });
    const auto draw_opaque = [&](const auto& batches) {
      for (const auto& one : batches)
        if (one.batch->opacity == 1)
          rasterize(*one.batch, by_, how_, [&](index_t i, index_t pixel, float z) {
            put(nearest_[0][pixel], key_of(z, one.first + static_cast<std::uint32_t>(i)),
                threads_ == 1);
          });
    };
    draw_opaque(all_.lines);
    draw_opaque(all_.triangles);
  }

  /// Each pixel the mean of those it is made of.
  [[nodiscard]] image<rgb> picture() {
    if (options_.blend) mix_splats();
    if (all_.is_transparent) gather_veils();
    const edge_lighting edges{nearest_[0], by_, options_.edges, how_};
    const color background = color_of(options_.background);
    const int fine = by_.fineness;
    image<rgb> result(by_.width / fine, by_.height / fine);
    parallel_blocks(result.height(), 4, how_, [&](index_t, index_t begin, index_t end) {
      std::vector<float> light(static_cast<std::size_t>(by_.width));
      std::vector<color> sums(static_cast<std::size_t>(result.width()));
      for (index_t y = begin; y < end; ++y) {
        std::ranges::fill(sums, color::Zero());
        for (index_t row = y * fine; row < (y + 1) * fine; ++row) {
          edges.row(static_cast<int>(row), light);
          for (index_t x = 0; x < by_.width; ++x) {
            const index_t pixel = row * by_.width + x;
            const color own =
                nearest_[0][pixel] == nothing ? background : color_at(pixel, light[x]);
            sums[fine == 1 ? x : x / fine] +=
                veils_.empty() ? own : behind_veil(veils_[pixel], own);
          }
        }
        for (int x = 0; x < result.width(); ++x) {
          const color mean = sums[x] / float(fine * fine);
          for (int k = 0; k < 3; ++k)
            result(x, int(y))[k] =
                static_cast<std::uint8_t>(std::clamp(mean[k], 0.0f, 255.0f) + 0.5f);
        }
      }
    });
    return result;
  }

  [[nodiscard]] depth_and_number key_at(index_t pixel) const { return nearest_[0][pixel]; }

 private:
  /// Calls `f(mine, i, splat)` for the splats of a batch, from several threads at once, `mine`
  /// being a place that no other thread has meanwhile if each has its own.
  void draw_splats(const numbered<point_batch>& one, auto&& f) {
    places own{nearest_.size()};
    const index_t count = (one.batch->points.cols() + stride_ - 1) / stride_;
    parallel_blocks(count, 4096, how_, [&](index_t, index_t begin, index_t end) {
      const auto draw = [&](std::size_t mine) {
        for_splats(*one.batch, by_, stride_, begin, end,
                   [&](index_t i, const splat& s) { f(mine, i, s); });
      };
      if (has_own_)
        own.lend(draw);
      else
        draw(0);
    });
  }
  /// In the camera's coordinates; nothing if a splat is round.
  [[nodiscard]] std::optional<Eigen::Vector3f> disc_normal(const numbered<point_batch>& one,
                                                           index_t i) const {
    if (!one.batch->along_normals) return std::nullopt;
    const auto own = one.batch->normals.col(i);
    if (!is_finite(own) || own.isZero(0)) return std::nullopt;
    return one.in_camera.linear * own;
  }
  /// Calls `f(pixel, share, z)` for the pixels of a splat.
  void for_covered(const numbered<point_batch>& one, index_t i, const splat& s, auto&& f) const {
    if (const auto normal = disc_normal(one, i))
      for_pixels(s, *normal, grid_, kernels_.cover_by_disc, f);
    else
      for_pixels(s, by_, [&](index_t pixel, float share) {
        if (share <= 1) f(pixel, share, s.z);
      });
  }
  /// Pixels for each thread, all cleared at once.
  template <class T>
  void clear(std::vector<std::vector<T>>& all, const T& value) const {
    const auto size = static_cast<std::size_t>(by_.width) * static_cast<std::size_t>(by_.height);
    parallel_blocks(std::ssize(all), 1, execution{how_.threads}, [&](index_t k, index_t, index_t) {
      all[k].assign(size + detail::keys_behind, value);
    });
  }
  /// What threads have in their own places, in the first one.
  template <class T>
  void gather(std::vector<std::vector<T>>& all, auto&& add) {
    for (std::size_t k = 1; k < all.size(); ++k)
      parallel_for(std::ssize(all[0]), how_,
                   [&](index_t pixel) { add(all[0][pixel], all[k][pixel]); });
  }
  static void put(depth_and_number& seen, depth_and_number key, bool is_alone) {
    if (is_alone) {
      seen = std::min(seen, key);
      return;
    }
    const std::atomic_ref shared{seen};
    auto before = shared.load(std::memory_order_relaxed);
    while (key < before && !shared.compare_exchange_weak(before, key, std::memory_order_relaxed)) {
    }
  }

  [[nodiscard]] static bool is_lit(const point_batch& batch) {
    return batch.lit && batch.normals.cols() > 0;
  }
  [[nodiscard]] color lit_point(const numbered<point_batch>& one, index_t i) const {
    const auto& batch = *one.batch;
    color own = color_of(batch.colors, i);
    if (!is_lit(batch)) return own;
    return own * light_on(one.in_camera.linear * batch.normals.col(i),
                          towards_eye(one.in_camera(batch.points.col(i))));
  }
  [[nodiscard]] Eigen::Vector3f towards_eye(const Eigen::Vector3f& p) const {
    return by_.orthographic ? Eigen::Vector3f{0, 0, -1} : Eigen::Vector3f{-p};
  }

  /// The pixel of the texture that is nearest to a place in a triangle.
  [[nodiscard]] static color texture_at(const triangle_batch& batch, const auto& corners,
                                        const Eigen::Vector3d& shares) {
    Eigen::Vector2d place = Eigen::Vector2d::Zero();
    for (int k = 0; k < 3; ++k)
      place +=
          shares[k] / shares.sum() * batch.texture_places.col(corners[k]).template cast<double>();
    const auto& texture = *batch.texture;
    const auto nearest = [](double at, int size) {
      return static_cast<int>(std::clamp(std::floor(at + 0.5), 0.0, size - 1.0));
    };
    return color_of(
        texture(nearest(place.x(), texture.width()), nearest(place.y(), texture.height())));
  }

  /// Where the pixel sees a triangle: the weights of its corners.
  [[nodiscard]] color lit_triangle(const numbered<triangle_batch>& one, index_t i,
                                   index_t pixel) const {
    const auto& batch = *one.batch;
    const auto& place = one.in_camera;
    const auto corners = batch.triangles.col(i);
    Eigen::Matrix3d p;
    for (int k = 0; k < 3; ++k) p.col(k) = place(batch.points.col(corners[k])).cast<double>();
    const Eigen::Vector3d normal = (p.col(1) - p.col(0)).cross(p.col(2) - p.col(0));
    const index_t row = pixel / by_.width;
    const auto ray = by_.through(double(pixel - row * by_.width), double(row));
    const double t = normal.dot(p.col(0) - ray.origin) / normal.dot(ray.direction);
    const Eigen::Vector3d at = ray.origin + t * ray.direction;
    Eigen::Vector3d shares;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d a = p.col((k + 1) % 3), b = p.col((k + 2) % 3);
      const double share = (b - a).cross(at - a).dot(normal) / normal.squaredNorm();
      shares[k] = std::isfinite(share) ? std::clamp(share, 0.0, 1.0) : 1 / 3.0;
    }
    const Eigen::Vector3f weights = shares.cast<float>();
    color own = color_of(batch.colors, corners[0]);
    if (batch.texture)
      own = texture_at(batch, corners, shares);
    else if (batch.colors.cols() > 1)
      own = (weights[0] * own + weights[1] * color_of(batch.colors, corners[1]) +
             weights[2] * color_of(batch.colors, corners[2])) /
            weights.sum();
    if (!batch.lit) return own;
    Eigen::Vector3f facing = normal.cast<float>();
    if (batch.normals.cols() > 0) {
      facing.setZero();
      for (int k = 0; k < 3; ++k)
        facing += weights[k] * (place.linear * batch.normals.col(corners[k]));
    }
    return own * light_on(facing, towards_eye(at.cast<float>()));
  }

  /// `light`: what edges leave.
  [[nodiscard]] color color_at(index_t pixel, float light) const {
    const auto number = static_cast<std::uint32_t>(nearest_[0][pixel]);
    if (number >= all_.first_triangle) {
      const auto& own = drawing::of(all_.triangles, number);
      const color lit = lit_triangle(own, number - own.first, pixel);
      return own.batch->lit ? color{light * lit} : lit;
    }
    if (number >= all_.first_line) {
      const auto& own = drawing::of(all_.lines, number);
      return light * color_of(own.batch->colors, number - own.first);
    }
    if (!sums_.empty()) {
      const auto& [red_green, blue_weight] = sums_[0][pixel];
      if (const auto weight = float(blue_weight & 0xffffffffu); weight > 0)
        return color{float(red_green >> 32), float(red_green & 0xffffffffu),
                     float(blue_weight >> 32)} *
               (light / weight);
    }
    const auto& own = drawing::of(all_.points, number);
    return light * lit_point(own, number - own.first);
  }

  /// What a splat counts in a pixel; nothing if it does not cover it, or is well behind the
  /// nearest.
  [[nodiscard]] std::uint64_t weight_in(index_t pixel, float share, float z, float diameter) const {
    const auto key = nearest_[0][pixel];
    // Without a branch: which splats are hidden, no processor can foresee.
    const bool counts = (share <= 1) & (static_cast<std::uint32_t>(key) < all_.first_line) &
                        !(z - depth_of(key) > diameter);
    const int weight = static_cast<int>(1 + float(most_weight_ - 1) * (1 - share));
    return static_cast<std::uint64_t>(counts ? weight : 0);
  }
  /// The colour of a point, as a sum of weight 1.
  [[nodiscard]] color_sum lit_sum(const numbered<point_batch>& one, index_t i) const {
    const color lit = lit_point(one, i);
    const auto part = [&](int k) { return static_cast<std::uint64_t>(lit[k] + 0.5f); };
    return {part(0) << 32 | part(1), part(2) << 32 | 1};
  }
  /// A small splat: first what it counts in all of its pixels, since many count in none.
  void mix_nine(std::vector<color_sum>& sums, const numbered<point_batch>& one, index_t i,
                const splat& s) {
    const nine_pixels nine{s, by_};
    std::array<std::uint64_t, 9> weights;
    std::uint64_t any = 0;
    const auto pixel = [&](std::size_t k) {
      return nine.first + static_cast<index_t>(k / 3) * by_.width + static_cast<index_t>(k % 3);
    };
    for (std::size_t k = 0; k < 9; ++k)
      any |= weights[k] = weight_in(pixel(k), nine.shares[k], s.z, s.diameter);
    if (any == 0) return;
    const auto own = lit_sum(one, i);
    for (std::size_t k = 0; k < 9; ++k)
      if (has_own_ || weights[k] != 0) add_to(sums[pixel(k)], own, weights[k], has_own_);
  }
  /// Adds up the splats that are hardly behind the nearest one.
  void mix_splats() {
    // No sum must reach 2^32, wherever all points are.
    most_weight_ = static_cast<int>(
        std::min<std::uint64_t>((1ull << 32) / (255ull * (all_.first_line + 1ull)), 16));
    if (most_weight_ == 0 || all_.points.empty()) return;
    sums_.resize(nearest_.size());
    clear(sums_, {});
    for (const auto& one : all_.points) {
      if (one.batch->opacity < 1) continue;
      draw_splats(one, [&](std::size_t mine, index_t i, const splat& s) {
        if (!one.batch->along_normals && nine_pixels::hold(s, by_)) {
          mix_nine(sums_[mine], one, i, s);
          return;
        }
        // Light costs more than a splat: where there is any, only what is seen is lit.
        if (!is_lit(*one.batch) && !one.batch->along_normals && has_own_ &&
            !nine_pixels::suffice(s)) {
          kernels_.mix_round(
              {round_of(s, by_), s.z, s.diameter, lit_sum(one, i), all_.first_line, most_weight_},
              nearest_[0].data(), grid_, sums_[mine].data());
          return;
        }
        std::optional<color_sum> own;
        for_covered(one, i, s, [&](index_t pixel, float share, float z) {
          const auto weight = weight_in(pixel, share, z, s.diameter);
          if (weight == 0) return;
          if (!own) own = lit_sum(one, i);
          add_to(sums_[mine][pixel], *own, weight, has_own_);
        });
      });
    }
    gather(sums_, [](color_sum& to, const color_sum& from) {
      to.red_green += from.red_green;
      to.blue_weight += from.blue_weight;
    });
  }

  /// Adds up what is transparent.
  void gather_veils() {
    veils_.resize(nearest_[0].size());
    const auto draw_transparent = [&](const auto& batches, auto&& draw) {
      for (const auto& one : batches) {
        const double opacity = one.batch->opacity;
        if (opacity == 0 || opacity == 1) continue;
        draw(one, [&, opacity, opaqueness = opaqueness_of(opacity)](index_t pixel, float z,
                                                                    const color& own) {
          const auto key = nearest_[0][pixel];
          if (!(z < depth_of(key)) && key != nothing) return;
          // Nearer ones count more, without an order.
          const double share = by_.nearest > 0 ? std::clamp(by_.nearest * 1e3 / z, 1e-2, 1e2) : 1;
          const auto weight = static_cast<std::uint64_t>(1 + 4096 * opacity * share * share);
          auto& sum = veils_[pixel];
          add_to(sum.red, weight * std::uint64_t(own[0] + 0.5f), threads_ == 1);
          add_to(sum.green, weight * std::uint64_t(own[1] + 0.5f), threads_ == 1);
          add_to(sum.blue, weight * std::uint64_t(own[2] + 0.5f), threads_ == 1);
          add_to(sum.weight, weight, threads_ == 1);
          add_to(sum.opaqueness, opaqueness, threads_ == 1);
        });
      }
    };
    draw_transparent(all_.points, [&](const auto& one, const auto& add) {
      draw_splats(one, [&](std::size_t, index_t i, const splat& s) {
        const color own = lit_point(one, i);
        for_covered(one, i, s, [&](index_t pixel, float, float z) { add(pixel, z, own); });
      });
    });
    draw_transparent(all_.lines, [&](const auto& one, const auto& add) {
      rasterize(*one.batch, by_, how_, [&](index_t i, index_t pixel, float z) {
        add(pixel, z, color_of(one.batch->colors, i));
      });
    });
    draw_transparent(all_.triangles, [&](const auto& one, const auto& add) {
      rasterize(*one.batch, by_, how_, [&](index_t i, index_t pixel, float z) {
        add(pixel, z, lit_triangle(one, i, pixel));
      });
    });
  }
  [[nodiscard]] static color behind_veil(const veil& sum, const color& own) {
    if (sum.weight == 0) return own;
    const auto through = float(std::exp2(-double(sum.opaqueness) / opaqueness_unit));
    const color mean = color{float(sum.red), float(sum.green), float(sum.blue)} / float(sum.weight);
    return through * own + (1 - through) * mean;
  }

  const drawing& all_;
  const projector& by_;
  detail::pixel_grid grid_ = grid_of(by_);
  detail::splat_kernels kernels_ = splat_kernels_here();
  const render_options& options_;
  execution how_;
  int threads_;
  /// Whether each thread has pixels of its own, which takes memory; many threads disturb each other
  /// little in the same.
  bool has_own_ = threads_ <= 4;
  index_t stride_;                                      ///< One of so many points is drawn.
  std::vector<std::vector<depth_and_number>> nearest_;  ///< The first one is that of all.
  std::vector<std::vector<color_sum>> sums_;            ///< The same, where splats are mixed.
  int most_weight_ = 0;                                 ///< Of a splat in the middle.
  std::vector<veil> veils_;                             ///< Where anything is transparent.
};

struct picture_size {
  int width, height;
};
picture_size size_of(const view& from, const render_options& o) {
  const auto& camera = from.camera;
  expect_view(from, "render");
  expects(o.width >= 0 && o.height >= 0 && (o.width > 0) == (o.height > 0),
          "render: .width and .height must be both positive, or both 0 for those of the camera");
  expects(1 <= o.supersampling && o.supersampling <= 8,
          "render: .supersampling must be from 1 to 8");
  expect_between(0, o.edges, 1e6, "render: edges");
  expects(o.point_budget >= 0, "render: .point_budget must not be negative");
  const picture_size size{o.width > 0 ? o.width : camera.width,
                          o.height > 0 ? o.height : camera.height};
  constexpr int longest = 1 << 15;
  expects(
      size.width <= longest && size.height <= longest &&
          index_t(size.width) * size.height * o.supersampling * o.supersampling <=
              detail::most_pixels,
      "render: the picture is larger than 32768 x 32768, or than 2^26 pixels when supersampled");
  return size;
}

}  // namespace

image<rgb> render(const scene& all, const view& from, const render_options& options) {
  const auto [width, height] = size_of(from, options);
  const int fine = options.supersampling;
  const projector by{from, width, height, fine};
  const drawing drawn{all, by};
  painter paint{drawn, by, options};
  const auto report = [&](double done) {
    if (options.monitor.progress) options.monitor.progress(done);
  };
  paint.find_nearest();
  report(0.5);
  image<rgb> picture = paint.picture();
  report(0.9);
  draw_overlay(picture, all, projector{from, width, height, 1}, options);
  report(1);
  return picture;
}

image<rgb> render(const scene& all, const render_options& options) {
  view_options size;
  if (options.width > 0) size.width = options.width;
  if (options.height > 0) size.height = options.height;
  return render(all, fit(all, size), options);
}

std::optional<picked> pick(const scene& all, const view& from, double x, double y,
                           const render_options& options) {
  const auto [width, height] = size_of(from, options);
  expects(std::isfinite(x) && std::isfinite(y), "pick: the pixel must be finite");
  const double column = std::floor(x + 0.5), row = std::floor(y + 0.5);
  if (column < 0 || row < 0 || column >= width || row >= height) return std::nullopt;
  // The one pixel as a picture.
  projector by{from, width, height, 1};
  by.cx -= column;
  by.cy -= row;
  by.width = by.height = 1;
  const drawing drawn{all, by};
  painter paint{drawn, by, options};
  paint.find_nearest();
  const auto key = paint.key_at(0);
  if (key == nothing) return std::nullopt;

  const auto ray = by.through(0, 0);
  const auto number = static_cast<std::uint32_t>(key);
  const auto result = [&](const auto& own, picked_kind kind, double depth) {
    const Eigen::Vector3d at = ray.origin + depth * ray.direction;
    return picked{own.layer->name, kind, own.place, index_t(number) - own.first,
                  by.to_camera.transpose() * at + by.eye};
  };
  const double depth = depth_of(key);
  if (number >= drawn.first_triangle)
    return result(drawing::of(drawn.triangles, number), picked_kind::triangle, depth);
  if (number >= drawn.first_line)
    return result(drawing::of(drawn.lines, number), picked_kind::line, depth / line_lift);
  return result(drawing::of(drawn.points, number), picked_kind::point, depth);
}

}  // namespace cilantro
