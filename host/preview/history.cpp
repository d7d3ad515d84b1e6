#include "preview/history.hpp"

namespace brume::preview {

void History::push(Chain chain, const std::string& what, const std::string& key) {
    states_.resize(place_ + 1);
    if (!key.empty() && states_.back().key == key) {
        states_.back().chain = std::move(chain);
        return;
    }
    states_.push_back({std::move(chain), what, key});
    if (states_.size() > most) states_.erase(states_.begin());
    place_ = states_.size() - 1;
}

void History::undo() {
    if (!canUndo()) return;
    close();
    place_--;
    close();
}

void History::redo() {
    if (!canRedo()) return;
    place_++;
    close();
}

void History::change(const std::function<void(Chain&)>& everyState) {
    for (State& state : states_) everyState(state.chain);
}

}  // namespace brume::preview
