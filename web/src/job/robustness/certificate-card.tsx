/** The newest certificate of a job's best design. */

import { get } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Job } from '../../api/types'
import { Card, Loaded } from '../../components/card'
import { StateBadge } from '../../components/state'
import { jobPath } from '../../router/routes'
import { CertifyButton, certificateNote } from '../certificate/certify'
import { Failures } from '../certificate/failures'
import { loadCertificate, outcomeOfCertificate } from '../outcome'

export function CertificateCard({ job }: { job: Job }) {
  const note = certificateNote(job)
  const newest = useResource(note, async (signal) => {
    const query = { kind: 'certificate', search: note!, limit: 1 } as const
    const { items } = await get('/v1/jobs', { query, signal })
    const [item] = items
    if (!item) return { item: null, certificate: null }
    const ended = item.state === 'succeeded'
    return { item, certificate: ended ? await loadCertificate(item) : null }
  })
  return (
    <Card title="Certificate" tools={<CertifyButton job={job} primary={!newest.data?.item} />}>
      <Loaded resource={newest} what="the certificate">
        {({ item, certificate }) =>
          item === null ? (
            <p>
              A certificate simulates the best design in many worlds, with other friction, masses,
              batteries and sensors, and shows how often it fails. There is none yet.
            </p>
          ) : (
            <div class="stack">
              <p class="row">
                <StateBadge
                  state={item.state}
                  outcome={certificate && outcomeOfCertificate(certificate)}
                />
                <a href={jobPath(item.id)}>{item.name || item.id}</a>
              </p>
              {certificate && <Failures certificate={certificate} id={item.id} />}
            </div>
          )
        }
      </Loaded>
    </Card>
  )
}
