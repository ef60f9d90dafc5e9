/** Spec of a job, commands to run it again, evidence and provenance. */

import { url } from '../../api/client'
import type { Job } from '../../api/types'
import { CopyBlock } from '../../components/copy-button'
import { withQuery } from '../../router/routes'
import { curlCommand, submitCommand } from './commands'
import { OptimizerCard } from './optimizer-card'
import { ProvenanceCard } from './provenance-card'
import { StartCard } from './start-card'

export function ReproducePanel({ job }: { job: Job }) {
  return (
    <div class="stack">
      <section class="card" aria-labelledby="again">
        <header class="row spread">
          <h2 id="again">Run this job again</h2>
          <a class="button compact" href={withQuery('/jobs/new', { clone: job.id })}>
            Clone in the form
          </a>
        </header>
        <div class="stack">
          <p class="muted small">
            The same spec with the same seed yields the same designs, bit for bit, if the provenance
            below is the same.
          </p>
          <div class="stack-tight">
            <h3>With the command line</h3>
            <CopyBlock label="the command" text={submitCommand(job.spec, location.origin)} />
          </div>
          <div class="stack-tight">
            <h3>With curl</h3>
            <CopyBlock label="the curl command" text={curlCommand(job.spec, location.origin)} />
          </div>
        </div>
      </section>
      {job.iterations > 0 && <EvidenceCard job={job} />}
      <OptimizerCard job={job} />
      <StartCard job={job} />
      <ProvenanceCard job={job} />
      <section class="card" aria-labelledby="spec">
        <h2 id="spec">Spec as JSON</h2>
        <CopyBlock label="the spec" text={JSON.stringify(job.spec, null, 2)} />
      </section>
    </div>
  )
}

function EvidenceCard({ job }: { job: Job }) {
  return (
    <section class="card" aria-labelledby="evidence">
      <header class="row spread">
        <h2 id="evidence">Evidence</h2>
        <a
          class="button compact"
          href={url('/v1/jobs/{job_id}/evidence', { job_id: job.id })}
          download={`${job.id}.zip`}
        >
          Download
        </a>
      </header>
      <div class="stack">
        <p class="muted small">
          One file with spec, robot, provenance and every evaluation. It can be verified anywhere,
          bit for bit.
        </p>
        <CopyBlock label="the verification" text={`gaitswarm verify ${job.id}.zip --replay 50`} />
      </div>
    </section>
  )
}
