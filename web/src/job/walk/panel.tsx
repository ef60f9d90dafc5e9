/** Walk of a job's designs, within its page. */

import type { Job } from '../../api/types'
import { EmptyCard } from '../../components/card'
import { usePlace } from '../../router/navigation'
import { sourceOfWord } from '../../walk/design/design-source'
import { Walk } from '../../walk/page'

export default function WalkPanel({ job }: { job: Job }) {
  const { query } = usePlace()
  if (job.best === null) {
    return (
      <EmptyCard title="No walk yet">
        The best design walks here once one has succeeded in every scenario.
      </EmptyCard>
    )
  }
  return (
    <Walk
      source={{ job: job.id }}
      against={sourceOfWord(query.get('against'))}
      query={query}
      embedded
    />
  )
}
