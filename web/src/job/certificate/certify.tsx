/** Command that queues a certificate of a job's best design. */

import { patch, post } from '../../api/client'
import { useCommand } from '../../api/resource'
import type { Job, JobSpec } from '../../api/types'
import { ErrorNotice } from '../../components/feedback'
import { placeWord } from '../../format/place'
import { navigate } from '../../router/navigation'
import { jobPath } from '../../router/routes'

/** Relates a certificate to the design of its job. */
export function certificateNote({ id, best }: Job): string | null {
  return best && `Design ${placeWord(best)} of job ${id}`
}

/** Queue a certificate of the best design, in the job's scenarios, and show it. */
export function CertifyButton({ job, primary = false }: { job: Job; primary?: boolean }) {
  const { busy, error, during } = useCommand()
  const certify = async () => {
    const { robot, controller, scenarios, preference } = job.spec as JobSpec
    const design = { ...job.best!.design }
    const name = `certificate of ${job.name || job.id}`
    const spec = { kind: 'certificate', name, robot, controller, design, scenarios, preference }
    const { id } = await post('/v1/jobs', { body: spec as never })
    const body = { note: certificateNote(job) }
    await patch('/v1/jobs/{job_id}', { path: { job_id: id }, body })
    navigate(jobPath(id))
  }
  return (
    <>
      <button
        type="button"
        class={primary ? 'primary' : ''}
        title="Simulate the best design in 1000 worlds with other friction, masses and sensors"
        disabled={busy}
        onClick={() => during(certify())}
      >
        Certify
      </button>
      {error !== null && <ErrorNotice what="Could not queue the certificate." error={error} />}
    </>
  )
}
