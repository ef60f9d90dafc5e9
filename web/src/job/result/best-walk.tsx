/** Replay of a job's best design in its first scenario. */

import type { Job } from '../../api/types'
import { RATE, WalkStage } from '../../walk/player/walk-stage'
import { recordBest } from './poster'

interface BestWalkProps {
  job: Job
  best: number
  visible: boolean
}

export default function BestWalk({ job, best, visible }: BestWalkProps) {
  return (
    <WalkStage
      name={`walk ${job.id} ${best}`}
      record={(signal) => recordBest(job, RATE, signal)}
      label="Replay of the best design"
      visible={visible}
    />
  )
}
