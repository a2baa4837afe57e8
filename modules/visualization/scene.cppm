// SPDX-License-Identifier: MIT
export module cilantro.visualization:scene;

import cilantro.standard;
import cilantro.core;
import :canvas;
import :clouds;

namespace cilantro {

/// Named layers of what is drawn. A value: copies share what was drawn, which never changes, so
/// they cost little and may go to other threads.
export class scene {
 public:
  /// One thing, as it was when it was set.
  struct layer {
    std::string name;                       ///< No two layers have the same.
    std::shared_ptr<const canvas> content;  ///< What it consists of.
    bool is_hidden = false;                 ///< Whether it is left out of pictures.
  };

  /// Adds a layer, or replaces what the layer of that name shows, at its place in the order.
  template <Renderable R>
  scene& set(std::string name, const R& thing) [[clang::lifetimebound]] {
    canvas on;
    if constexpr (requires { thing.draw(on); })
      thing.draw(on);
    else
      draw(thing, on);
    return put(std::move(name), std::move(on));
  }
  /// As above, with a look, such as `cloud_look` for clouds.
  template <class R, class Look = cloud_look>
    requires RenderableWith<R, Look>
  scene& set(std::string name, const R& thing, const Look& look) [[clang::lifetimebound]] {
    canvas on;
    draw(thing, on, look);
    return put(std::move(name), std::move(on));
  }
  /// Takes a layer away. Throws `invalid_input`, with the names there are, if there is none of that
  /// name.
  scene& remove(std::string_view name);
  /// Hides a layer, or shows it again. Throws as `remove` does.
  scene& hide(std::string_view name, bool is_hidden = true);

  /// In the order in which they were set. Valid until a layer is set or removed.
  [[nodiscard]] std::span<const layer> layers() const [[clang::lifetimebound]] { return layers_; }
  /// The box around all layers that are not hidden; empty if there is nothing.
  [[nodiscard]] Eigen::AlignedBox3d bounds() const;

 private:
  scene& put(std::string name, canvas content);
  [[nodiscard]] std::vector<layer>::iterator named(std::string_view name);

  std::vector<layer> layers_;
};

}  // namespace cilantro
