#include "apply/apply.hpp"

namespace brume {

RunResult applyChain(Runner& runner, const Chain& chain, const FramePair& captured,
                     const std::vector<std::string>& keep, std::vector<StepPlan>* decisions) {
    return applyChain(runner, chain, resolveDepth(captured, chain.policy), keep, decisions);
}

RunResult applyChain(Runner& runner, const Chain& chain, const ReadyFrame& ready,
                     const std::vector<std::string>& keep, std::vector<StepPlan>* decisions) {
    std::map<std::string, std::string> airlights;
    Chain stated = withAirlight(withSidecar(chain, ready.frame), ready.frame, &airlights);
    Chain planned = planChain(stated, ready.frame, runner.backend(), keep, decisions);
    if (decisions)
        for (auto& decision : *decisions)
            if (auto found = airlights.find(decision.id); found != airlights.end()) {
                decision.plan.why += (decision.plan.why.empty() ? "" : "; ") + found->second;
                decision.planned = true;
            }
    RunResult result = runner.run(planned, ready.frame, keep);
    if (ready.restore.empty()) return result;
    auto& color = result.images.at("color");
    if (color.size() != ready.frame.size()) return result;
    if (color.data == ready.frame.color.data) color = color.clone();
    cv::Mat none;
    auto transmittance = result.images.find("transmittance");
    restorePixels(ready, color, transmittance == result.images.end() ? none : transmittance->second);
    return result;
}

}  // namespace brume
