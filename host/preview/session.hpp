// What is being worked on: the frames, the chain with its history, where the preset lies. Knows no window.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "effect/preset.hpp"
#include "frame/frame_pair.hpp"
#include "frame/sequence.hpp"
#include "preview/frame_words.hpp"
#include "preview/history.hpp"
#include "preview/watcher.hpp"

namespace brume::preview {

/// A sentence for the person at the window.
struct Message {
    std::string text;
    bool isError = false;
};

/// Not thread-safe: lives on the window's thread.
class Session {
  public:
    explicit Session(const EffectRegistry& registry);

    // --- frames ---
    /// Throws Error (Io, Usage) and leaves everything as it was.
    void openFrames(const FrameWords& words);
    /// As `--depth-encoding`; counts for the whole sequence.
    void readDepthAs(const std::string& encoding);
    const FrameWords& words() const { return words_; }
    /// As `--max-pixels`; counts for all frames opened from now on.
    void limitPixels(size_t most) { maxPixels_ = most; }
    size_t maxPixels() const { return maxPixels_; }
    ReadOptions readOptions() const;
    const std::vector<FrameFiles>& frames() const { return frames_; }
    size_t current() const { return current_; }
    void goTo(size_t frame) { current_ = std::min(frame, frames_.empty() ? 0 : frames_.size() - 1); }
    /// Grows whenever frames must be read anew.
    uint64_t framesRevision() const { return framesRevision_; }

    // --- the preset ---
    /// A preset's file or name, or an effect's name. Throws Error and leaves everything as it was.
    void openPreset(const std::string& pathOrName);
    /// Dropped on the window: presets (.json with "effects"), effects (.fs), else frames.
    void openAny(const std::vector<std::string>& paths);
    /// Throws Error (Io), or Error (CheckFailed) if it would not be read back equal.
    void savePreset(const std::string& path);
    const std::string& presetName() const { return presetName_; }  ///< as it was named; may be empty
    bool isSaved() const { return writePreset(chain()) == savedText_; }

    // --- editing ---
    const Chain& chain() const { return history_.now(); }
    /// One undoable change; edits with the same non-empty key that follow each other are one.
    void edit(const std::string& what, const std::string& key, const std::function<void(Chain&)>& change);
    void setValue(size_t step, const Parameter& parameter, const ParameterValue& value, bool isDrag = false);
    void resetValue(size_t step, const Parameter& parameter);
    void addEffect(const std::string& nameOrPath);
    void endDrag() { history_.close(); }
    void undo();
    void redo();
    const History& history() const { return history_; }
    const EffectRegistry& registry() const { return registry_; }

    // --- what to render ---
    /// Grows with every change of what chainToRender gives.
    uint64_t revision() const { return revision_; }
    Chain chainToRender() const;
    uint64_t programs() const { return programs_; }
    /// What came of a revision: an effect loaded anew is adopted if it ran, and else given up.
    void rendered(uint64_t revision, const std::string& error);

    // --- files that may change ---
    /// Looks whether preset, shaders, their includes or plugins changed, and takes them up.
    void pollFiles();

    // --- words ---
    const Message& message() const { return message_; }
    void say(const std::string& text, bool isError = false) { message_ = {text, isError}; }
    /// Why an effect file as it is now could not be used: "fog.fs:12: error: ..."; empty: it can.
    const std::string& fileError() const { return fileError_; }

  private:
    void adopt(Chain chain, const std::string& what);
    void bringUpToDate(Chain& chain) const;
    std::shared_ptr<const Effect> loadAnew(const std::string& fsPath) const;
    void reloadPreset();
    void reloadEffects(const std::vector<std::string>& changed);
    void watchFiles();
    void changed() { revision_++; }

    const EffectRegistry& registry_;
    const std::filesystem::file_time_type started_ = std::filesystem::file_time_type::clock::now();
    FrameWords words_;
    size_t maxPixels_ = ReadOptions().maxPixels;
    std::vector<FrameFiles> frames_;
    size_t current_ = 0;
    uint64_t framesRevision_ = 0;

    History history_;
    std::string presetName_, presetFile_, savedText_;
    uint64_t revision_ = 1, programs_ = 0;

    Watcher watcher_;
    struct Trial {
        std::vector<std::shared_ptr<const Effect>> effects;
        uint64_t revision = 0;  // from which on it is rendered
        uint64_t programsBefore = 0;
    };
    std::optional<Trial> trial_;
    Message message_;
    std::string fileError_;
};

/// Without the includes' files being read again: what an effect runs as long as its files are mistaken.
std::shared_ptr<const Effect> withSourceKept(const std::shared_ptr<const Effect>& effect);

/// The command that makes the same picture (of a sequence: all pictures): "brume apply fog.json frame.exr -o
/// frame.png --backend gl". Values that differ from the saved preset follow as --set. Throws Error (Usage)
/// where only a saved preset can say it (other effects than saved, lists, image names).
std::string applyLine(const Session& session, const std::string& backend);

}  // namespace brume::preview
