/** Replay of a job's best design in its first scenario. */

import type { Job } from '../../api/types'
import { resolveDesign } from '../../walk/design/resolve-design'
import { RATE, WalkStage } from '../../walk/player/walk-stage'
import { recordWalk } from '../../walk/replay/replay'

interface BestWalkProps {
  job: Job
  best: number
  visible: boolean
}

export default function BestWalk({ job, best, visible }: BestWalkProps) {
  const record = async (signal: AbortSignal) => {
    const design = await resolveDesign({ job: job.id }, signal)
    return recordWalk(design, design.scenarios[0] ?? 'normal-fast', RATE, signal)
  }
  return (
    <WalkStage
      name={`walk ${job.id} ${best}`}
      record={record}
      label="Replay of the best design"
      visible={visible}
    />
  )
}
