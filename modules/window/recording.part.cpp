// SPDX-License-Identifier: MIT
//
// Films of what a window shows. Internal.
module cilantro.window:recording;

import cilantro.standard;
import cilantro.visualization;

namespace cilantro {

/// A film of pictures that come when they come: each is shown until the next, however long that is.
class recording {
 public:
  using clock = std::chrono::steady_clock;

  recording(const std::filesystem::path& path, const video_options& options, image<rgb> first)
      : film_{path, options}, seconds_{1 / options.frames_per_second}, seen_{std::move(first)} {
    film_.add(seen_);
  }
  [[nodiscard]] int width() const { return seen_.width(); }
  [[nodiscard]] int height() const { return seen_.height(); }

  /// Repeats the last picture until now. Where frames take longer to write than they are seen, some
  /// are left out, and the film is shorter than what happened: else each update would take longer
  /// than the one before.
  void catch_up() {
    const auto now = clock::now();
    const auto longest =
        std::max<clock::duration>(std::chrono::milliseconds{50}, (now - last_) / 2);
    const auto due = static_cast<long long>((now - begin_) / seconds_);
    for (; frames_ < due && clock::now() - now < longest; ++frames_) film_.add(seen_);
    if (frames_ < due)
      begin_ += std::chrono::duration_cast<clock::duration>(seconds_ * double(due - frames_));
    last_ = clock::now();
  }
  void add(image<rgb> next) {
    catch_up();
    seen_ = std::move(next);
  }
  void finish() {
    catch_up();
    film_.add(seen_);
    film_.finish();
  }

 private:
  video film_;
  std::chrono::duration<double> seconds_;  ///< Of a frame.
  image<rgb> seen_;
  clock::time_point begin_ = clock::now(), last_ = begin_;
  long long frames_ = 1;
};

}  // namespace cilantro
