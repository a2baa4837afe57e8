// SPDX-License-Identifier: MIT
module;
#include "io/common/file.hpp"
module cilantro.visualization;

import :overlay;
import :packing;

namespace cilantro {
namespace {

constexpr char page[] = {
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wc23-extensions"
#embed "page.html" suffix(, )
#pragma clang diagnostic pop
    '\0'};

/// Whether all points that a column of indices names are finite.
template <class Batch>
bool are_finite(const Batch& batch, const auto& indices) {
  return std::ranges::all_of(indices, [&](int i) { return is_finite(batch.points.col(i)); });
}
/// Without what is not finite, which is drawn nowhere and makes boxes endless.
line_batch with_finite_lines(line_batch batch) {
  index_t n = 0;
  for (index_t i = 0; i < batch.segments.cols(); ++i) {
    if (!are_finite(batch, batch.segments.col(i))) continue;
    batch.segments.col(n) = batch.segments.col(i).eval();
    if (batch.colors.cols() > 1) batch.colors.col(n) = batch.colors.col(i).eval();
    ++n;
  }
  batch.segments.conservativeResize(2, n);
  if (batch.colors.cols() > 1) batch.colors.conservativeResize(3, std::max<index_t>(n, 2));
  return batch;
}
triangle_batch with_finite_triangles(triangle_batch batch) {
  index_t n = 0;
  for (index_t i = 0; i < batch.triangles.cols(); ++i)
    if (are_finite(batch, batch.triangles.col(i)))
      batch.triangles.col(n++) = batch.triangles.col(i).eval();
  batch.triangles.conservativeResize(3, n);
  return batch;
}

std::string_view truth(bool is_so) {
  return is_so ? "true" : "false";
}

/// What the page reads: a description of the scene as JSON, and streams that it counts.
class page_content {
 public:
  explicit page_content(const html_options& options)
      : how_{options.threads, task_monitor{{}, options.monitor.stop}} {}

  page_content& operator<<(std::string_view text) {
    json_ += text;
    return *this;
  }
  page_content& operator<<(double number) {
    std::array<char, 32> text{};
    json_.append(text.data(), std::to_chars(text.begin(), text.end(), number).ptr);
    return *this;
  }
  /// Whatever is written, it stays a text, and does not end the script that it is in.
  page_content& quote(std::string_view text) {
    constexpr std::string_view digits = "0123456789abcdef";
    json_ += '"';
    for (const char c : text) {
      const auto code = static_cast<unsigned char>(c);
      if (code < 0x20 || c == '"' || c == '\\' || c == '<' || c == '>' || c == '&')
        ((json_ += "\\u00") += digits[code >> 4]) += digits[code & 15];
      else
        json_ += c;
    }
    json_ += '"';
    return *this;
  }
  page_content& list(const auto& numbers) {
    json_ += '[';
    for (bool is_first = true; const auto number : numbers) {
      if (!std::exchange(is_first, false)) json_ += ',';
      *this << double(number);
    }
    json_ += ']';
    return *this;
  }
  page_content& list_of(const auto& things, auto&& add) {
    json_ += '[';
    for (bool is_first = true; const auto& thing : things) {
      if (!std::exchange(is_first, false)) json_ += ',';
      add(thing);
    }
    json_ += ']';
    return *this;
  }

  void add(const point_batch& batch) {
    const grid on{batch};
    const size_scale sizes{batch.size};
    const auto order = along_a_curve(batch, on, how_);
    const auto count = std::ssize(order);
    const auto chunks = (count + points_in_chunk - 1) / points_in_chunk;
    *this << R"({"count":)" << double(count) << R"(,"chunk":)" << double(points_in_chunk);
    *this << R"(,"low":)";
    list(on.low) << R"(,"step":)" << on.step;
    *this << R"(,"isLength":)" << truth(batch.size.in == point_size::unit::length);
    *this << R"(,"sizes":)";
    list(std::array{sizes.low, sizes.high});
    *this << R"(,"isLit":)" << truth(batch.lit) << R"(,"alongNormals":)"
          << truth(batch.along_normals);
    *this << R"(,"each":{"size":)" << truth(batch.size.sizes.size() > 1);
    *this << R"(,"color":)" << truth(batch.colors.cols() > 1) << R"(,"normal":)"
          << truth(batch.normals.cols() > 0) << "}";
    add_common(batch);
    const auto first = streams_.size();
    streams_.resize(first + static_cast<std::size_t>(chunks));
    parallel_blocks(count, points_in_chunk, how_, [&](index_t block, index_t begin, index_t end) {
      streams_[first + static_cast<std::size_t>(block)] = packed_points(
          batch, on, sizes, std::span{order}.subspan(std::size_t(begin), std::size_t(end - begin)));
    });
  }
  void add(const line_batch& whole) {
    const auto batch = with_finite_lines(whole);
    *this << R"({"points":)" << double(batch.points.cols()) << R"(,"count":)"
          << double(batch.segments.cols()) << R"(,"width":)" << batch.width;
    *this << R"(,"each":{"color":)" << truth(batch.colors.cols() > 1) << "}";
    add_common(batch);
    bytes data;
    append_values(data, batch.points);
    append_values(data, batch.segments);
    if (batch.colors.cols() > 1) append_values(data, batch.colors);
    streams_.push_back(packed(data));
  }
  void add(const triangle_batch& whole) {
    const auto batch = with_finite_triangles(whole);
    *this << R"({"points":)" << double(batch.points.cols()) << R"(,"count":)"
          << double(batch.triangles.cols());
    *this << R"(,"each":{"color":)" << truth(batch.colors.cols() > 1) << R"(,"normal":)"
          << truth(batch.normals.cols() > 0) << "}";
    *this << R"(,"isLit":)" << truth(batch.lit);
    if (batch.texture)
      *this << R"(,"texture":{"width":)" << batch.texture->width() << R"(,"height":)"
            << batch.texture->height() << "}";
    add_common(batch);
    bytes data;
    append_values(data, batch.points);
    append_values(data, batch.triangles);
    if (batch.colors.cols() > 1) append_values(data, batch.colors);
    if (batch.normals.cols() > 0) append_values(data, batch.normals);
    if (batch.texture) append_values(data, batch.texture_places);
    streams_.push_back(packed(data));
    if (batch.texture) streams_.push_back(packed_pixels(*batch.texture));
  }
  void add(const label& one) {
    *this << R"({"text":)";
    quote(one.text) << R"(,"place":)";
    list(one.place) << R"(,"color":)";
    if (one.color)
      list(*one.color);
    else
      *this << "null";
    *this << R"(,"height":)" << one.height << "}";
  }
  void add(const color_legend& one) {
    *this << R"({"title":)";
    quote(one.title) << R"(,"colors":)";
    list_of(one.colors, [&](const rgb& color) { list(color); });
    const double range = one.high - one.low;
    *this << R"(,"numbers":)";
    list_of(std::array{one.low, one.low / 2 + one.high / 2, one.high},
            [&](double value) { quote(in_few_digits(value, range)); });
    *this << "}";
  }

  [[nodiscard]] const std::string& json() const { return json_; }
  [[nodiscard]] const std::vector<std::string>& streams() const { return streams_; }

 private:
  void add_common(const auto& batch) {
    *this << R"(,"origin":)";
    list(batch.origin) << R"(,"opacity":)" << batch.opacity << R"(,"color":)";
    if (batch.colors.cols() == 1)
      list(batch.colors.col(0));
    else
      *this << "null";
    *this << "}";
  }

  execution how_;
  std::string json_;
  std::vector<std::string> streams_;
};

void describe(page_content& content, const view& from) {
  const auto& camera = from.camera;
  content << R"({"width":)" << camera.width << R"(,"height":)" << camera.height << R"(,"fx":)"
          << camera.fx << R"(,"fy":)" << camera.fy << R"(,"cx":)" << camera.cx << R"(,"cy":)"
          << camera.cy << R"(,"turn":)";
  content.list(camera.to_world.linear().reshaped<Eigen::RowMajor>()) << R"(,"eye":)";
  content.list(from.eye()) << R"(,"distance":)" << from.distance << R"(,"up":)";
  content.list(from.up) << R"(,"orthographic":)" << truth(from.orthographic) << "}";
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '<')
      result += "&lt;";
    else if (c == '&')
      result += "&amp;";
    else
      result += c;
  }
  return result;
}

/// The page before a mark, which is a comment, and the page after it.
std::array<std::string_view, 2> parted_at(std::string_view text, std::string_view mark) {
  const auto at = text.find(mark);
  expects(at != std::string_view::npos, "write_html: the page lacks " + std::string{mark});
  return {text.substr(0, at), text.substr(at + mark.size())};
}

void expect_page_size(const scene& all) {
  index_t points = 0, others = 0;
  for (const auto& layer : all.layers()) {
    for (const auto& batch : layer.content->points()) points += batch.points.cols();
    for (const auto& batch : layer.content->lines())
      others += std::max(batch.points.cols(), batch.segments.cols());
    for (const auto& batch : layer.content->triangles()) {
      others += std::max(batch.points.cols(), batch.triangles.cols());
      expects(!batch.texture || std::max(batch.texture->width(), batch.texture->height()) <= 8192,
              "write_html: a page holds textures and images up to 8192 pixels wide and high: make "
              "them smaller");
    }
  }
  constexpr index_t most = 10'000'000;
  expects(
      points <= most && others <= most,
      "write_html: a page holds up to 10,000,000 points, and as many lines and triangles; these "
      "are " +
          std::to_string(points) + " and " + std::to_string(others) +
          ": make them fewer by voxel_downsample, or draw pictures by write_picture");
}

}  // namespace

void write_html(const scene& all, const std::filesystem::path& path, const html_options& options) {
  write_html(all, fit(all), path, options);
}

void write_html(const scene& all, const view& from, const std::filesystem::path& path,
                const html_options& options) {
  expects(ending_of(path) == ".html", "write_html: the name of a page must end in .html");
  expect_view(from, "write_html");
  (void)orbit(from, {});  // Which is what hands will do.
  expect_between(0, options.edges, 1e6, "write_html: edges");
  expect_page_size(all);

  page_content content{options};
  content << R"({"title":)";
  content.quote(options.title) << R"(,"background":)";
  content.list(options.background)
      << R"(,"edges":)" << options.edges << R"(,"blend":)" << truth(options.blend)
      << R"(,"labels":)" << truth(options.labels) << R"(,"legends":)" << truth(options.legends)
      << R"(,"view":)";
  describe(content, from);
  content << R"(,"layers":)";
  index_t done = 0;
  content.list_of(all.layers(), [&](const scene::layer& layer) {
    const auto add_all = [&](std::string_view name, const auto& things) {
      content << name;
      content.list_of(things, [&](const auto& thing) { content.add(thing); });
    };
    content << R"({"name":)";
    content.quote(layer.name) << R"(,"isHidden":)" << truth(layer.is_hidden);
    add_all(R"(,"points":)", layer.content->points());
    add_all(R"(,"lines":)", layer.content->lines());
    add_all(R"(,"triangles":)", layer.content->triangles());
    add_all(R"(,"labels":)", layer.content->labels());
    add_all(R"(,"legends":)", layer.content->legends());
    content << "}";
    if (options.monitor.progress)
      options.monitor.progress(double(++done) / double(all.layers().size() + 1));
  });
  content << "}";

  const auto [head, behind_title] = parted_at(page, "<!-- title -->");
  const auto [body, behind_scene] = parted_at(behind_title, "<!-- scene -->");
  const auto [between, script] = parted_at(behind_scene, "<!-- shaders -->");
  try {
    detail::output_file file{path};
    const auto put = [&](std::string_view text) { file.write(text.data(), text.size()); };
    put(head);
    put(escaped(options.title));
    put(body);
    put(R"(<script id="scene" type="application/json">)");
    put(content.json());
    put("</script>\n");
    for (const auto& stream : content.streams()) {
      if (options.monitor.stop.stop_requested()) throw cancelled{};
      put(R"(<script class="stream" type="text/plain">)");
      put(stream);
      put("</script>\n");
    }
    put(between);
    put(shader_text());
    put(script);
    file.commit();
  } catch (const std::system_error& error) {
    throw io_error{path, "cannot be written: " + error.code().message()};
  }
  if (options.monitor.progress) options.monitor.progress(1);
}

}  // namespace cilantro
