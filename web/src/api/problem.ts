/** API errors as problem details (RFC 9457). */

export interface FieldError {
  /** Dotted path of the field; empty for the request as a whole. */
  readonly field: string
  readonly message: string
}

/** A problem response, or no response at all (status 0). */
export class ApiProblem extends Error {
  override readonly name = 'ApiProblem'

  constructor(
    /** HTTP status; 0 without a response. */
    readonly status: number,
    readonly detail: string,
    readonly errors: readonly FieldError[] = [],
  ) {
    super(detail)
  }
}

/** Whether there was no response at all, so that the same request may succeed later. */
export function isOffline(error: unknown): boolean {
  return error instanceof ApiProblem && error.status === 0
}

/** Read the problem of a response, whatever its body. */
export async function problemOf(response: Response): Promise<ApiProblem> {
  const type = response.headers.get('content-type') ?? ''
  if (type.includes('json')) {
    const body = (await response.json().catch(() => null)) as Partial<ProblemBody> | null
    if (body && typeof body.detail === 'string') {
      return new ApiProblem(response.status, body.detail, body.errors ?? [])
    }
  }
  const reason = response.statusText || 'no reason given'
  return new ApiProblem(response.status, `the server responded with ${response.status}: ${reason}`)
}

export function messageOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error)
}

interface ProblemBody {
  detail: string
  errors: FieldError[]
}
