// SPDX-License-Identifier: MIT
//
// Films as files. Failures of the system are `std::system_error`s. Internal.
module;
#include <cerrno>

#include "io/common/file.hpp"
module cilantro.visualization:frame_writer;

import cilantro.standard;
import cilantro.core;
import cilantro.io;
import :child_process;

namespace cilantro {

/// So many frames in so many seconds.
struct frame_rate {
  int frames, seconds;
};

/// What frames are written to. All have the size that `begin` says, and there is at least one.
class frame_writer {
 public:
  frame_writer() = default;
  frame_writer(const frame_writer&) = delete;
  frame_writer& operator=(const frame_writer&) = delete;
  virtual ~frame_writer() = default;

  virtual void begin(int, int) {}
  virtual void add(const image<rgb>& frame) = 0;
  virtual void finish() {}
};

/// A luma and two chroma values.
struct luma_chroma {
  std::uint8_t y, cb, cr;
};
/// BT.601 in the limited range: 16 to 235, and 16 to 240 around 128. The definition's decimals as
/// fractions of integers, so that only the result is rounded.
inline luma_chroma luma_chroma_of(const rgb& color) {
  const int red = color[0], green = color[1], blue = color[2];
  const int luma = 299 * red + 587 * green + 114 * blue;  // 1000 times that of the full range.
  const auto scaled = [](int value, int by, int out_of, int middle) {
    return static_cast<std::uint8_t>((by * value + middle * out_of + out_of / 2) / out_of);
  };
  return {scaled(luma, 219, 255'000, 16), scaled(1000 * blue - luma, 112, 255 * 886, 128),
          scaled(1000 * red - luma, 112, 255 * 701, 128)};
}

/// YUV4MPEG2.
class y4m_writer : public frame_writer {
 public:
  y4m_writer(const std::filesystem::path& path, const frame_rate& rate)
      : file_{path}, rate_{rate} {}

  void begin(int width, int height) override {
    write("YUV4MPEG2 W" + std::to_string(width) + " H" + std::to_string(height) + " F" +
          std::to_string(rate_.frames) + ":" + std::to_string(rate_.seconds) +
          " Ip A1:1 C444 XCOLORRANGE=LIMITED\n");
  }
  void add(const image<rgb>& frame) override {
    const std::size_t pixels = frame.pixels().size();
    planes_.resize(3 * pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
      const auto [y, cb, cr] = luma_chroma_of(frame.pixels()[i]);
      planes_[i] = static_cast<char>(y);
      planes_[pixels + i] = static_cast<char>(cb);
      planes_[2 * pixels + i] = static_cast<char>(cr);
    }
    write("FRAME\n");
    write(planes_);
  }
  void finish() override { file_.commit(); }

 private:
  void write(const std::string& bytes) { file_.write(bytes.data(), bytes.size()); }

  detail::output_file file_;
  frame_rate rate_;
  std::string planes_;
};

/// The name of a file around the number of a frame.
struct numbered_name {
  std::filesystem::path folder;
  std::string before, after;
  std::size_t digits = 1;  ///< At least.

  /// For a name with one `%d` or `%04d`. What else is in it stands for itself.
  static std::optional<numbered_name> of(const std::filesystem::path& path) {
    const std::string name = path.filename().string();
    std::optional<numbered_name> found;
    for (std::size_t at = name.find('%'); at != std::string::npos; at = name.find('%', at + 1)) {
      const bool is_padded =
          at + 2 < name.size() && name[at + 1] == '0' && name[at + 2] >= '1' && name[at + 2] <= '9';
      const std::size_t end = at + (is_padded ? 3 : 1);
      if (end >= name.size() || name[end] != 'd') continue;
      if (found) return std::nullopt;
      found = {path.parent_path(), name.substr(0, at), name.substr(end + 1),
               is_padded ? static_cast<std::size_t>(name[at + 2] - '0') : 1};
    }
    return found;
  }
  [[nodiscard]] std::filesystem::path operator()(index_t number) const {
    std::string text = std::to_string(number);
    if (text.size() < digits) text.insert(0, digits - text.size(), '0');
    return folder / (before + text + after);
  }
};

/// Pictures of frames.
class numbered_pictures : public frame_writer {
 public:
  explicit numbered_pictures(numbered_name name) : name_{std::move(name)} {}
  void add(const image<rgb>& frame) override { write_png(frame, name_(next_++)); }

 private:
  numbered_name name_;
  index_t next_ = 0;
};

/// H.264 in MP4, by the program ffmpeg.
class mp4_writer : public frame_writer {
 public:
  mp4_writer(const std::filesystem::path& path, const frame_rate& rate)
      : path_{path}, file_{path}, rate_{rate} {}

  void begin(int width, int height) override {
    // What players know has chroma for two by two pixels.
    padded_ = image<rgb>(width + width % 2, height + height % 2);
    try {
      ffmpeg_.emplace(std::vector<std::string>{
          "ffmpeg", "-nostdin", "-loglevel", "error",
          // Otherwise it ends with 0 even where the disk is full.
          "-xerror",  //
          "-f", "rawvideo", "-pixel_format", "rgb24", "-video_size",
          std::to_string(padded_.width()) + "x" + std::to_string(padded_.height()), "-framerate",
          std::to_string(rate_.frames) + "/" + std::to_string(rate_.seconds), "-i", "pipe:0",
          // Players take films that do not say so for one or the other by their size.
          "-vf", "scale=out_color_matrix=bt709:out_range=tv", "-colorspace", "bt709",
          "-color_primaries", "bt709", "-color_trc", "iec61966-2-1", "-color_range", "tv",  //
          "-c:v", "h264", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-y", "-f", "mp4",
          // Without the name of a protocol, one with a colon or a dash would be taken for others.
          "file:" + file_.place().string()});
    } catch (const std::system_error& error) {
      if (error.code().value() != ENOENT && error.code().value() != EACCES) throw;
      throw io_error{path_,
                     "cannot be written: .mp4 needs the program ffmpeg, which is not installed "
                     "(on Debian: apt install ffmpeg); .y4m, and .png with %04d for the number of "
                     "the frame, need none"};
    }
  }
  void add(const image<rgb>& frame) override {
    const bool is_even = frame.width() == padded_.width() && frame.height() == padded_.height();
    if (!is_even) pad(frame);
    const image<rgb>& whole = is_even ? frame : padded_;
    if (!ffmpeg_->send(std::as_bytes(std::span{whole.pixels()}))) fail(ffmpeg_->end());
  }
  void finish() override {
    const std::string problem = ffmpeg_->end();
    if (!problem.empty()) fail(problem);
    std::error_code ignored;
    if (std::filesystem::file_size(file_.place(), ignored) == 0) fail("it has written nothing");
    file_.commit();
  }

 private:
  void pad(const image<rgb>& frame) {
    for (int y = 0; y < padded_.height(); ++y)
      for (int x = 0; x < padded_.width(); ++x)
        padded_(x, y) = frame(x < frame.width() ? x : frame.width() - 1,
                              y < frame.height() ? y : frame.height() - 1);
  }
  [[noreturn]] void fail(const std::string& why) const {
    throw io_error{path_, "cannot be written: ffmpeg failed" + (why.empty() ? "" : ": " + why)};
  }

  std::filesystem::path path_;
  detail::output_file file_;
  frame_rate rate_;
  image<rgb> padded_;
  // Behind the file, so that the program ends before the file is removed.
  std::optional<child_process> ffmpeg_;
};

}  // namespace cilantro
