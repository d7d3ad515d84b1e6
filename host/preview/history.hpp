// Undo and redo: the chain as it was before each edit.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "effect/chain.hpp"

namespace brume::preview {

/// Never empty; snapshots are small (effects are shared). Not thread-safe.
class History {
  public:
    explicit History(Chain chain) : states_{{std::move(chain), "", ""}} {}

    const Chain& now() const { return states_[place_].chain; }
    /// Edits that follow each other with the same non-empty `key` (one slider being dragged) are one step.
    void push(Chain chain, const std::string& what, const std::string& key = "");
    /// The next edit is a step of its own, whatever its key.
    void close() { states_[place_].key.clear(); }

    bool canUndo() const { return place_ > 0; }
    bool canRedo() const { return place_ + 1 < states_.size(); }
    /// What undo would take back: "visibility of depth_fog".
    std::string undoes() const { return canUndo() ? states_[place_].what : ""; }
    std::string redoes() const { return canRedo() ? states_[place_ + 1].what : ""; }
    void undo();
    void redo();

    /// For what is no edit: an effect loaded anew.
    void change(const std::function<void(Chain&)>& everyState);

  private:
    struct State {
        Chain chain;
        std::string what, key;
    };
    static constexpr size_t most = 500;
    std::vector<State> states_;
    size_t place_ = 0;
};

}  // namespace brume::preview
