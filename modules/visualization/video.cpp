// SPDX-License-Identifier: MIT
module cilantro.visualization;

import :frame_writer;

namespace cilantro {
namespace {

frame_rate nearest_rate(double per_second) {
  const auto frames = std::lround(per_second * 1000),
             of_television = std::lround(per_second * 1.001);
  if (std::abs(double(of_television) / 1.001 - per_second) <
      std::abs(double(frames) / 1000 - per_second))
    return {static_cast<int>(1000 * of_television), 1001};
  const auto common = std::gcd(frames, 1000l);
  return {static_cast<int>(frames / common), static_cast<int>(1000 / common)};
}

std::unique_ptr<frame_writer> writer_for(const std::filesystem::path& path,
                                         const frame_rate& rate) {
  const std::string ending = ending_of(path);
  if (ending == ".mp4") return std::make_unique<mp4_writer>(path, rate);
  if (ending == ".y4m") return std::make_unique<y4m_writer>(path, rate);
  if (auto name = numbered_name::of(path); ending == ".png" && name)
    return std::make_unique<numbered_pictures>(std::move(*name));
  throw invalid_input{
      "video: the name of a film ends in .mp4, in .y4m, or in .png with one %d or "
      "%04d for the number of the frame, and is " +
      path.string()};
}

/// `write()`, with what the system says as an error of the file.
template <class F>
auto writing(const std::filesystem::path& path, F write) {
  try {
    return write();
  } catch (const std::system_error& error) {
    throw io_error{path, "cannot be written: " + error.code().message()};
  }
}

}  // namespace

struct video::film {
  std::filesystem::path path;
  std::unique_ptr<frame_writer> writer;
  int width = 0, height = 0;  ///< Of all frames; 0 before the first.
};

video::video(const std::filesystem::path& path, const video_options& options) {
  expect_between(0.01, options.frames_per_second, 1000, "video: .frames_per_second");
  film_ = std::make_unique<film>(film{
      path,
      writing(path, [&] { return writer_for(path, nearest_rate(options.frames_per_second)); })});
}
video::video(video&& other) noexcept = default;
video& video::operator=(video&& other) noexcept = default;
video::~video() = default;

void video::add(const image<rgb>& frame) {
  expects(film_ != nullptr, "video: the film is finished, or was given up after an error");
  expects(!frame.pixels().empty(), "video: a frame must have pixels");
  auto& [path, writer, width, height] = *film_;
  expects(width == 0 || (frame.width() == width && frame.height() == height),
          "video: the frames of a film have one size, " + std::to_string(width) + " x " +
              std::to_string(height) + ", and this one has " + std::to_string(frame.width()) +
              " x " + std::to_string(frame.height()));
  // Given up unless all goes well.
  auto film = std::move(film_);
  writing(path, [&] {
    if (width == 0) writer->begin(frame.width(), frame.height());
    writer->add(frame);
  });
  width = frame.width();
  height = frame.height();
  film_ = std::move(film);
}

void video::finish() {
  expects(film_ != nullptr, "video: the film is finished, or was given up after an error");
  expects(film_->width > 0, "video: a film needs at least one frame");
  const auto film = std::move(film_);
  writing(film->path, [&] { film->writer->finish(); });
}

void write_video(const scene& all, std::span<const view> views, const std::filesystem::path& path,
                 const render_options& options, const video_options& film) {
  expects(!views.empty(), "write_video: a film needs at least one view");
  video made{path, film};
  render_options each = options;
  each.monitor = in_passes(options.monitor, static_cast<int>(views.size()));
  for (const view& from : views) made.add(render(all, from, each));
  made.finish();
}

}  // namespace cilantro
